// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"

namespace holdfast {

/// World poses of both feet in one frame: left, right.
struct FeetTarget {
  std::array<Eigen::Vector3d, 2> ankle;
  std::array<Eigen::Matrix3d, 2> rotation;  ///< of the ankle joints; the toe bend is kept
};

FeetTarget FeetOf(const BodyPlacement& placed);
std::vector<FeetTarget> FeetOf(std::span<const BodyPlacement> placed);

/// Solves both legs so that the feet reach their targets; each knee stays on its side. Returns the
/// larger distance between an ankle and its target (0: both reached), meters.
double PlaceLegs(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet, BodyFrame& frame);

/// Moves ankle targets that the legs cannot reach towards the hip: by at most 4 cm in height, and
/// for the rest along the ground, since higher feet would no longer stand. Returns the larger
/// displacement, meters.
double DrawIntoReach(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& frame, FeetTarget& feet);

/// Returns how far the pelvis must be lowered in each frame for both legs to reach with the knees
/// bent by at least 3 degrees. Smoothed over neighboring frames. Meters, not negative.
std::vector<double> PelvisSink(const Eigen::Matrix3Xd& rest_joints,
                               const std::vector<BodyFrame>& frames,
                               const std::vector<FeetTarget>& feet);

}  // namespace holdfast
