// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "generator/matching/capture_set.h"
#include "generator/wandr/network.h"
#include "geometry/body/body_model.h"
#include "geometry/parallel.h"

namespace holdfast {

struct OptimizedReachesOptions {
  int count = 800;          ///< reaches to try
  double farthest_m = 4.5;  ///< way to a goal
  /// LatentOptions::path. What fails is left out, so that pace may come first.
  double path_weight = 0.16;
  std::uint64_t seed = 1;
  int threads = 1;       ///< the result does not depend on them
  bool replace = false;  ///< a set in the folder that was made from something else
  std::string version;   ///< of the program, for the manifest
  std::string network;   ///< checksum of the weights, for the manifest
};

struct OptimizedReachesReport {
  bool stopped = true;  ///< by `progress`
  int kept = 0, dropped = 0;
  double minutes = 0.0;  ///< of motion kept
};

/// Reaches of OptimizeLatents, refitted, from frames of captured people who are learned from to
/// drawn goals, due by PaceOf or (a quarter) DeadlineRule, of the right wrist: reach_*.npz with
/// goals (WriteGoalClip) and manifest.json (schema holdfast/optimized-reaches/1) in `folder`. What
/// misses its goal, leaves the ground or runs is left out. A network that is trained on them does
/// at once what its own optimizer finds in a second. A set that was stopped is resumed, a finished
/// one extended. Progress has the stage "reaches optimized". Throws Error for a manifest of
/// something else, and for a set of which nobody stands or walks.
OptimizedReachesReport MakeOptimizedReaches(const CaptureSet& set, const BodyModel& body,
                                            const wandr::NetworkWeights& network,
                                            const OptimizedReachesOptions& options,
                                            const std::filesystem::path& folder,
                                            const StagedProgress& progress = {});

}  // namespace holdfast
