// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "generator/wandr/network.h"
#include "geometry/clip/clip.h"
#include "solver/reach/reach_options.h"
#include "solver/reach/reach_person.h"

namespace holdfast {

/// A start and a goal, written down: what motions are judged on that no choice was made on.
struct ListedReach {
  std::filesystem::path clip;  ///< any file that LoadClip reads
  int frame = 0;               ///< at the rate that LoadClip gives the clip, from 0
  /// Where the wrist is wanted, meters: ahead of and to the left of the pelvis by the heading in
  /// that frame, and above the ground.
  Eigen::Vector3d ahead_left_up = Eigen::Vector3d::Zero();
};

/// A table with a first line "clip,frame,ahead,left,up", then a line each; clips are found in
/// `root`. Throws Error naming file and line for what is not that, and for a clip that is not
/// there.
std::vector<ListedReach> ReadListedReaches(const std::filesystem::path& table,
                                           const std::filesystem::path& root);

struct ListedMotion {
  Clip clip;                                       ///< at 30 Hz, frame 0 the start
  Eigen::Vector3d goal = Eigen::Vector3d::Zero();  ///< world
  bool reached = false;                            ///< within 10 cm in some frame
  bool rests = false;                              ///< within 2 cm in all of the last half second
};

/// The motion that `options` make from there (WalkAndReach's best).
ListedMotion MakeListedReach(const ListedReach& listed,
                             const std::shared_ptr<const BodyModel>& body,
                             const wandr::NetworkWeights& network, const ReachOptions& options);

}  // namespace holdfast
