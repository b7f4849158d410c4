// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// How somebody who stands never stands still: small rotations of pelvis, trunk, head and arms, and
/// of the pelvis over the feet, nothing in the first frame, phases by `seed`. Amplitudes and speeds
/// are the medians of 43 stretches of 2.5 s in which captured people stand and do nothing. Legs are
/// left to the caller.
void AddSway(double frame_rate, std::uint64_t seed, std::vector<BodyFrame>& frames);

/// What the rest of a person does once the right hand is where it goes, key frames having nothing
/// of it: looks up and back at the thing, nods at the phone, aims the camera anew, shifts weight
/// from leg to leg, moves the free arm. All of it smooth (minimum jerk), times and amounts drawn by
/// `seed`. Feet and the grasp stay as they are; the object goes along with the hand that has it.
void AddSecondaryMotion(const Eigen::Matrix3Xd& rest_joints, std::string_view action,
                        std::uint64_t seed, Clip& clip);

}  // namespace holdfast
