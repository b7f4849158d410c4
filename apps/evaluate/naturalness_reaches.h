// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "generator/walk_statistics/motion_set.h"
#include "geometry/body/body_model.h"

namespace holdfast::apps {

/// Motions made for `evaluate naturalness` from a list of starts and goals.
struct NaturalnessReachOptions {
  std::string list;  ///< a table as ReadListedReaches takes it; empty: none
  std::string root;  ///< of the clips that it names; empty: the table's folder
  std::vector<std::string> methods = {"intention", "latent-opt"};
  std::string weights;  ///< empty: the embedded network
};
void AddNaturalnessReachOptions(CLI::App& command, NaturalnessReachOptions& options);

struct NaturalnessReaches {
  bool stopped = false;
  std::vector<MotionSet> sets;  ///< a set for each method: reaches/METHOD/NNN.npz in the folder
  std::string text;             ///< goals reached, wrists that rest: a line for each method
  nlohmann::json json;
};
/// Makes them and writes their clips below `folder`.
NaturalnessReaches MakeNaturalnessReaches(const NaturalnessReachOptions& options,
                                          const std::shared_ptr<const BodyModel>& body,
                                          const std::filesystem::path& folder,
                                          const CommonOptions& common);

}  // namespace holdfast::apps
