// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "generator/matching/capture_set.h"
#include "geometry/parallel.h"

namespace holdfast {

enum class ReachWrists { kRight, kLeft, kBoth };  ///< kBoth: alternating clips

struct ReachDataOptions {
  double hours = 1.0;       ///< of motion
  int reaches = 3;          ///< consecutive goals per clip
  double farthest_m = 5.0;  ///< maximum distance to a goal
  double pace = 1.0;        ///< multiplies the speeds of MatchedReachOptions
  double blend_s = 0.35;    ///< of a transition
  ReachWrists wrists = ReachWrists::kRight;
  bool as_captured = false;  ///< keep reaches as captured; goals are where the wrists arrive
  std::uint64_t seed = 1;
  int threads = 1;       ///< does not affect the result
  bool replace = false;  ///< replace a set in the folder that has other provenance
  /// Program version, for the manifest: a set can only be resumed by the version that began it.
  std::string version;
};

struct ReachDataReport {
  bool stopped = true;   ///< by `progress`
  nlohmann::json head;   ///< of the manifest; once complete with "summary" and "statistics"
  double minutes = 0.0;  ///< of motion; fewer than requested if nearly all clips are rejected
  int tried = 0;         ///< clips, including earlier runs
  int had = 0;           ///< earlier runs only
};

/// Generates walking, turning and reaching with goals from captures: writes made/*.npz and
/// manifest.json (schema holdfast/reach-data/1) to `folder`. The clips have arrays goal (K x 3,
/// world, meters), goal_frame (K) and goal_wrist (K): the wrist joint is at the goal in its frame.
/// An interrupted set is resumed, a complete one extended. Progress has the stage "minutes
/// generated". Throws Error for a manifest with other provenance, and as MakeReachClip does.
ReachDataReport MakeReachData(const CaptureSet& set, const ReachDataOptions& options,
                              const std::filesystem::path& folder,
                              const StagedProgress& progress = {});

}  // namespace holdfast
