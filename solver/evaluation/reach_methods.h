// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/network.h"
#include "solver/evaluation/reach_method_study.h"

namespace holdfast {

/// What all methods run through; must outlive them.
struct ReachGenerator {
  const wandr::Network<float>& network;
  const wandr::BoneOffsets<float>& bones;
  const BodyMeasures& body;
};

/// Names that --methods takes, besides "all".
const std::vector<std::string>& ReachMethodNames();

struct ReachMethodsOptions {
  std::vector<std::string> methods;    ///< ReachMethodNames, or "all"
  bool fixed = true, adaptive = true;  ///< deadlines of the intention
  int samples = 5;                     ///< to each goal
  double sigma = 1.0;
  std::uint64_t seed = 1;
};

/// Those that are asked for, baselines first. The intention has one for each of its deadlines.
std::vector<ReachMethod> ReachMethodsOf(const ReachMethodsOptions& options,
                                        const ReachGenerator& with);

}  // namespace holdfast
