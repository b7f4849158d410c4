// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/motion_library.h"
#include "generator/matching/motion_player.h"

namespace holdfast {

struct MatchedReachOptions {
  int reaches = 4;             ///< number of successive goals
  double nearest_walk = 0.5;   ///< minimum horizontal distance (m) from the body to a goal ...
  double farthest_goal = 5.0;  ///< ... and maximum, for goals that are walked to
  double lowest_goal = 0.03;   ///< meters above the ground
  double highest_goal = 1.95;
  double pace = 1.0;                              ///< multiplies the speeds below
  double slowest = 1.0, fastest = 1.35;           ///< range of playback rates of captured motion
  double slowest_walk = 1.0, fastest_walk = 1.8;  ///< range of target walking speeds, m/s
  double begin_walking = 0.4;    ///< fraction of motions that begin in mid-walk instead of standing
  double without_walking = 0.2;  ///< fraction of goals within reach of the standing body
  double blend_s = 0.35;         ///< duration of a transition
  double goal_scatter_m = 0.25;  ///< maximum distance of a goal from the captured wrist at the mark
  Side wrist = Side::kRight;
};

/// One reach within a generated motion.
struct ReachEvent {
  Eigen::Vector3d goal;  ///< world, meters
  int frame = 0;         ///< at which the wrist is due at the goal
  int begin = 0;         ///< first frame of the captured reach
  int end = 0;           ///< one past the last frame of the captured reach
  int clip = 0;          ///< index in the library
  Side wrist = Side::kRight;
};

struct MatchedReaches {
  std::vector<BodyFrame> frames;
  std::vector<SoleBits> contacts;
  std::vector<MotionSegment> segments;
  std::vector<ReachEvent> reaches;
};

/// Generates a motion that repeatedly stands, turns, walks, stops and reaches. Motion matching
/// walks to a position from which a captured reach would bring the wrist near the goal; that reach,
/// or another that fits the stance better, then starts as soon as one fits. Some goals are within
/// reach of the standing body. Goals are drawn uniformly over direction, distance and height. The
/// wrist is not yet exactly at its goal (see ReachWarp), and feet may slide in transitions (see
/// LockFeet). Deterministic for the same library, options and seed.
///
/// Throws Error if the library has no reaches.
MatchedReaches MatchReaches(const MotionLibrary& library, const MatchedReachOptions& options,
                            std::uint64_t seed);

}  // namespace holdfast
