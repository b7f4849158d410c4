// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"

namespace holdfast {

/// Where both feet of one frame are: left, right. World.
struct FeetTarget {
  std::array<Eigen::Vector3d, 2> ankle;
  std::array<Eigen::Matrix3d, 2> rotation;  ///< of the ankle joints; toes keep their bend
};

FeetTarget FeetOf(const BodyPlacement& placed);
std::vector<FeetTarget> FeetOf(std::span<const BodyPlacement> placed);

/// Bends both legs so that the feet are where they are asked to be; knees stay on the side they
/// are on. Returns how far the farther ankle stays from its place (0: reached), meters.
double PlaceLegs(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet, BodyFrame& frame);

/// Feet that legs cannot reach come off their place towards the hip, by 4 cm of height at most, and
/// are drawn in along the ground for the rest: farther up, nobody would stand. Returns the way of
/// the farther, meters.
double DrawIntoReach(const Eigen::Matrix3Xd& rest_joints, const BodyFrame& frame, FeetTarget& feet);

/// How far each frame's pelvis must sink for both legs to reach, the knees at least 3 degrees bent;
/// spread over neighboring frames so that it is smooth. Meters, not negative.
std::vector<double> PelvisSink(const Eigen::Matrix3Xd& rest_joints,
                               const std::vector<BodyFrame>& frames,
                               const std::vector<FeetTarget>& feet);

}  // namespace holdfast
