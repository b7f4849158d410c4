// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/motion_library.h"
#include "generator/matching/motion_player.h"

namespace holdfast {

struct MatchedReachOptions {
  int reaches = 4;             ///< goals one after the other
  double nearest_walk = 0.5;   ///< meters along the ground from where the body is to the goal ...
  double farthest_goal = 5.0;  ///< ... of those that are walked to
  double lowest_goal = 0.03;   ///< meters above the ground
  double highest_goal = 1.95;
  double pace = 1.0;                              ///< multiplies the speeds below
  double slowest = 1.0, fastest = 1.35;           ///< retiming of what was captured
  double slowest_walk = 1.0, fastest_walk = 1.8;  ///< asked of walkers on the way, m/s
  double begin_walking = 0.4;    ///< share of motions that begin in mid-walk, not standing
  double without_walking = 0.2;  ///< share of goals in reach of where the body stands
  double blend_s = 0.35;         ///< of a transition
  double goal_scatter_m = 0.25;  ///< farthest that a goal is from where the captured wrist would be
  Side wrist = Side::kRight;
};

/// One reach within a generated motion.
struct ReachEvent {
  Eigen::Vector3d goal;  ///< world, meters
  int frame = 0;         ///< at which the wrist is to be there
  int begin = 0;         ///< first frame of the captured reach
  int end = 0;           ///< one past its last
  int clip = 0;          ///< of the library
  Side wrist = Side::kRight;
};

struct MatchedReaches {
  std::vector<BodyFrame> frames;
  std::vector<SoleBits> contacts;
  std::vector<MotionSegment> segments;
  std::vector<ReachEvent> reaches;
};

/// Somebody stands, turns, walks, stops and reaches, again and again: motion matching towards a
/// place from which a captured reach would bring the wrist near to the goal, then that reach, or
/// whichever fits the stance better, as soon as one fits. Some goals are in reach of where the body
/// stands. Goals are drawn evenly over direction, distance and height. The wrist is not yet at its
/// goal: see ReachWarp. Feet may slide in transitions: see LockFeet. The same library, options and
/// seed give the same motion.
///
/// Throws Error when the library has no reaches.
MatchedReaches MatchReaches(const MotionLibrary& library, const MatchedReachOptions& options,
                            std::uint64_t seed);

}  // namespace holdfast
