// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// Key frames of a synthesis as motion: a curve through them (ResampleSmoothly). Feet stay
/// where the first frame has them when no key frame has one 15 cm away; of somebody who steps,
/// those that stand stay where they are (LockFeet); who stands breathes and sways (AddSway of
/// `seed`) as no key frame can. The object's track is the key frames' along the same curve: the fit
/// of all frames makes it anew. The person's rest pose stands on measures.sole_y, the ground is z =
/// 0.
Clip MotionOfKeyFrames(const Clip& keys, const BodyMeasures& measures, double frame_rate,
                       std::uint64_t seed);

/// Puts bodies back into the clip that they are of (BodyFrames): joints 0..21 and trans, rotations
/// unwrapped towards those that the clip had.
void SetBodyFrames(const std::vector<BodyFrame>& frames, const Eigen::Matrix3Xd& rest_joints,
                   Clip& clip);

/// Where, in each frame of the clip, the wrist is that holds the object: the right one where it
/// does.
std::vector<Eigen::Isometry3d> HoldingHands(const Eigen::Matrix3Xd& rest_joints,
                                            const std::vector<BodyFrame>& frames, const Clip& clip);

/// The object goes along with the hand that holds it, which was at `hands` and is where `frames`
/// have it.
void TakeAlong(const Eigen::Matrix3Xd& rest_joints, const std::vector<BodyFrame>& frames,
               const std::vector<Eigen::Isometry3d>& hands, Clip& clip);

}  // namespace holdfast
