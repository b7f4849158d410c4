// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

#include "generator/actions/standing_start.h"
#include "geometry/body/body_model.h"
#include "geometry/parallel.h"
#include "solver/actions/action_plan.h"

namespace holdfast {

struct ActionSetReport {
  bool complete = false;  ///< false: stopped by `progress`
  nlohmann::json head;    ///< manifest header: the request and its "summary"
  int had = 0;            ///< clips tried in earlier runs
  int made = 0;           ///< clips tried in this run
  double seconds = 0.0;   ///< of this run, summed over threads
};

/// Synthesizes a labeled set of people acting with objects in `folder`: s1/mug_drink_1.npz ...,
/// manifest.json (schema holdfast/actions/1), and grasps/, a cache of grasps for later runs. An
/// interrupted set is resumed, a complete one extended. A rejected clip is retried from another
/// start and finally given up: see MakeActionClip. Progress (stage "clips") is reported per subject
/// and object. Throws Error as PlanActions does, for a manifest with other provenance, and for a
/// folder that cannot be written.
ActionSetReport MakeActionSet(const std::shared_ptr<const BodyModel>& body,
                              const ActionStarts& starts, const std::filesystem::path& folder,
                              const ActionSetOptions& options, const StagedProgress& progress = {});

}  // namespace holdfast
