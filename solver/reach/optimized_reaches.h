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
  double farthest_m = 4.5;  ///< maximum distance to a goal
  /// LatentOptions::path. Failures are dropped, so pace may have priority.
  double path_weight = 0.16;
  std::uint64_t seed = 1;
  int threads = 1;       ///< does not affect the result
  bool replace = false;  ///< replace a set in the folder that has other provenance
  std::string version;   ///< program version, for the manifest
  std::string network;   ///< checksum of the weights, for the manifest
};

struct OptimizedReachesReport {
  bool stopped = true;  ///< by `progress`
  int kept = 0, dropped = 0;
  double minutes = 0.0;  ///< of kept motion
};

/// Generates refitted OptimizeLatents reaches of the right wrist from frames of captured people of
/// the training split to random goals, due by PaceOf or (a quarter) DeadlineRule: reach_*.npz with
/// goals (WriteGoalClip) and manifest.json (schema holdfast/optimized-reaches/1) in `folder`.
/// Motions that miss the goal, leave the ground or run are dropped. A network trained on the set
/// does at once what its optimizer finds in a second. An interrupted set is resumed, a complete one
/// extended. Progress has the stage "reaches optimized". Throws Error for a manifest with other
/// provenance, and for a set in which nobody stands or walks.
OptimizedReachesReport MakeOptimizedReaches(const CaptureSet& set, const BodyModel& body,
                                            const wandr::NetworkWeights& network,
                                            const OptimizedReachesOptions& options,
                                            const std::filesystem::path& folder,
                                            const StagedProgress& progress = {});

}  // namespace holdfast
