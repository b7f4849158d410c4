// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "generator/matching/motion_library.h"

namespace holdfast {

/// How a walker on the ground is to move: to a place, there to face a direction.
struct WalkTarget {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;  ///< as Yaw(BodyFrame)
  double speed = 1.2;    ///< on the way, m/s
};

struct WalkState {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< world, m/s
  double yaw_rad = 0.0;
};

/// The unit vector that a body of this yaw faces along the ground.
Eigen::Vector2d Facing(double yaw_rad);
/// The yaw of a body that faces along a direction.
double YawToFace(const Eigen::Vector2d& direction);

/// Where a walker would be and face in 1/3, 2/3 and 1 s: turns before it walks off, slows down as
/// it comes near, faces the way it goes and in the end as the target asks.
FuturePath PlanWalk(const WalkState& now, const WalkTarget& target);

/// Standing where it is.
FuturePath PlanStand();

}  // namespace holdfast
