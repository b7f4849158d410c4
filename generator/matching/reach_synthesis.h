// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/motion_library.h"
#include "generator/matching/motion_player.h"

namespace holdfast {

struct SynthesisOptions {
  int reaches = 4;            ///< goals one after the other
  double nearest_goal = 0.3;  ///< metres along the ground from where the body is
  double farthest_goal = 5.0;
  double lowest_goal = 0.03;  ///< metres above the ground
  double highest_goal = 1.95;
  double slowest = 0.85, fastest = 1.15;  ///< retiming of what was captured
  double blend_s = 0.35;                  ///< of a transition
  double goal_scatter_m = 0.25;  ///< farthest that a goal is from where the captured wrist would be
  Side wrist = Side::kRight;
};

/// One reach within a made motion.
struct ReachEvent {
  Eigen::Vector3d goal;  ///< world, metres
  int frame = 0;         ///< at which the wrist is to be there
  int begin = 0;         ///< first frame of the captured reach
  int end = 0;           ///< one past its last
  int clip = 0;          ///< of the library
  Side wrist = Side::kRight;
};

struct SynthesizedMotion {
  std::vector<BodyFrame> frames;
  std::vector<SoleBits> contacts;
  std::vector<MotionSegment> segments;
  std::vector<ReachEvent> reaches;
};

/// Somebody stands, turns, walks, stops and reaches, again and again: motion matching towards a
/// place from which a captured reach would bring the wrist near to the goal, then that reach, or
/// whichever fits the stance better. Goals are drawn evenly over direction and distance, and over
/// the heights of the library's reaches. The wrist is not yet at its goal: see ReachWarp. Feet may
/// slide in transitions: see LockFeet. The same library, options and seed give the same motion.
///
/// Throws Error when the library has no reaches.
SynthesizedMotion SynthesizeReaches(const MotionLibrary& library, const SynthesisOptions& options,
                                    std::uint64_t seed);

}  // namespace holdfast
