// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/evaluate_reach.h"
#include "apps/reach_study_methods.h"
#include "generator/scripted/reach_motion.h"
#include "generator/wandr/network.h"

namespace holdfast::apps {

/// What all methods run through; must outlive them.
struct ReachGenerator {
  const wandr::Network<float>& network;
  const wandr::BoneOffsets<float>& bones;
  const BodyMeasures& body;
};

/// Names that --methods takes, besides "all".
const std::vector<std::string>& ReachMethodNames();

/// Those that are asked for, baselines first. The intention has one for each of its deadlines.
std::vector<ReachMethod> ReachMethodsOf(const EvaluateReachOptions& options,
                                        const ReachGenerator& with, std::uint64_t seed);

}  // namespace holdfast::apps
