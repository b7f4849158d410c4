// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// Adds postural sway of a standing person: small rotations of pelvis, trunk, head and arms, and
/// pelvis translation over the feet; zero in the first frame, random phases from `seed`. Amplitudes
/// and speeds are medians of 43 captured segments of 2.5 s of idle standing. Legs are left to the
/// caller.
void AddSway(double frame_rate, std::uint64_t seed, std::vector<BodyFrame>& frames);

/// Adds secondary motion after the end of the reach, which key frames lack: looking up and back at
/// the object, nodding on the phone, re-aiming the camera. All of it is smooth (minimum jerk), with
/// times and amounts drawn by `seed`. Feet and grasp are unchanged; the object moves with its hand.
void AddSecondaryMotion(const Eigen::Matrix3Xd& rest_joints, std::string_view action,
                        std::uint64_t seed, Clip& clip);

/// Adds what captured standing people do over the whole clip: the weight shifts from leg to leg,
/// the free arm moves, and the person looks up from the object and back, except while it is at the
/// face. Times and amounts are drawn by `seed`. Zero in the first frame; weight: until the object
/// leaves its place, and where the hand lets go of it. Feet and grasp are unchanged; the object
/// moves with its hand. `free_arm`: the left arm holds nothing; `table`: the person stands at one.
void AddStandingMotion(const Eigen::Matrix3Xd& rest_joints, std::string_view action, bool free_arm,
                       bool table, std::uint64_t seed, Clip& clip);

}  // namespace holdfast
