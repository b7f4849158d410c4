// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/clip/clip.h"

namespace holdfast {

/// The middle of the palm: 8 cm from the wrist along the fingers, in the frame of `wrist`'s target.
Eigen::Vector3d PalmOf(Side side, const Eigen::Isometry3d& wrist);

/// Both palms and the head over time, from joints.
struct PalmTracks {
  std::array<Eigen::Matrix3Xd, 2> at;                  ///< right and left: 3 x T, world, metres
  std::vector<Eigen::Isometry3d> head;                 ///< T, world from the head's joint
  Eigen::Vector3d forward = Eigen::Vector3d::UnitX();  ///< of the chest in the mean, level
  double frame_rate = 30.0;

  const Eigen::Matrix3Xd& Of(Side side) const { return at[side == Side::kRight ? 0 : 1]; }
  /// Of a palm: T, metres a second, between 0.04 s to either side.
  Eigen::VectorXd Speed(Side side) const;
};
PalmTracks TrackPalms(const Clip& clip, const Eigen::Matrix3Xd& rest_joints);

}  // namespace holdfast
