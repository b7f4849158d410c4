// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/retarget/ground_contact.h"

namespace holdfast {

/// Heels and balls of the feet, in the order of GroundProbe: left heel, left ball, right heel,
/// right ball. One column each, world metres.
using Soles = Eigen::Matrix<double, 3, GroundProbe::kNumSoles>;

/// Heels and balls of a placed body whose rest pose stands on `floor_y`.
class SolePoints {
 public:
  SolePoints(const Eigen::Matrix3Xd& rest_joints, double floor_y);
  Soles At(const BodyPlacement& placed) const;
  std::vector<Soles> At(std::span<const BodyPlacement> placed) const;

 private:
  Soles offset_;  // in the joint's frame
};

/// How fast a sole point (column) goes along the ground in frame t, m/s: over both neighbours.
double SpeedAlongGround(std::span<const Soles> soles, double frame_rate, int point, std::size_t t);

/// Bit i of a frame's contacts: sole point i is on the ground.
using SoleBits = std::uint8_t;
inline constexpr SoleBits kLeftSole = 0b0011, kRightSole = 0b1100;

/// Contacts of every frame: a point lower than 4 cm and slower than 0.35 m/s along the ground, in
/// runs of at least 3 frames at 30 Hz; gaps of up to 2 are closed.
std::vector<SoleBits> FindContacts(std::span<const Soles> soles, double frame_rate);

}  // namespace holdfast
