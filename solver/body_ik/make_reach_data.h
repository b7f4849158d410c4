// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "generator/matching/capture_set.h"
#include "geometry/parallel.h"

namespace holdfast {

enum class ReachWrists { kRight, kLeft, kBoth };  ///< kBoth: of every other clip

struct ReachDataOptions {
  double hours = 1.0;       ///< of motion
  int reaches = 3;          ///< goals one after the other in a clip
  double farthest_m = 5.0;  ///< way to a goal
  double pace = 1.0;        ///< multiplies the speeds of MatchedReachOptions
  double blend_s = 0.35;    ///< of a transition
  ReachWrists wrists = ReachWrists::kRight;
  bool as_captured = false;  ///< reaches stay as they are, goals are where the wrists come to
  std::uint64_t seed = 1;
  int threads = 1;       ///< the result does not depend on them
  bool replace = false;  ///< a set in the folder that was made from something else
  /// Of the program, for the manifest: a set is resumed by the version that began it.
  std::string version;
};

struct ReachDataReport {
  bool stopped = true;   ///< by `progress`
  nlohmann::json head;   ///< of the manifest; once made with "summary" and "statistics"
  double minutes = 0.0;  ///< of motion; fewer than wanted where nearly all clips have a fault
  int tried = 0;         ///< clips, with those of earlier runs
  int had = 0;           ///< of earlier runs alone
};

/// Makes walking, turning and reaching with goals from captures: made/*.npz and
/// manifest.json (schema holdfast/reach-data/1) in `folder`. The clips have arrays goal (K x 3,
/// world, meters), goal_frame (K) and goal_wrist (K): the wrist joint is at the goal in its frame.
/// A set that was stopped is resumed, a finished one extended. Progress has the stage "minutes
/// made". Throws Error for a manifest of something else, and what MakeReachClip throws.
ReachDataReport MakeReachData(const CaptureSet& set, const ReachDataOptions& options,
                              const std::filesystem::path& folder,
                              const StagedProgress& progress = {});

}  // namespace holdfast
