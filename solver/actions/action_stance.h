// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/action_script.h"
#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Where a face is wanted to point at a time of a script; `object` is what it may look at, `eyes`
/// where from (world). Unit, world.
Eigen::Vector3d GazeAt(const ActionScript& script, double time_s, const Eigen::Vector3d& eyes,
                       const Eigen::Vector3d& object);

/// How the chest leans: forward, then to the left, radians.
Eigen::Vector2d LeanAt(const ActionScript& script, double time_s);

/// The turn (world) of a trunk that leans so; forward is -y.
Eigen::Matrix3d LeanRotation(const Eigen::Vector2d& lean);

/// Roughly where chest, shoulders and head are when a body does as the script says: the start's,
/// turned at the lowest spine joint, the face turned to where it is asked to look.
struct NominalStance {
  Eigen::Matrix3d chest = Eigen::Matrix3d::Identity();  ///< world rotation of spine3
  Eigen::Vector3d chest_position = Eigen::Vector3d::Zero();
  Eigen::Vector3d right_shoulder = Eigen::Vector3d::Zero();
  Eigen::Vector3d left_shoulder = Eigen::Vector3d::Zero();
  Eigen::Isometry3d head = Eigen::Isometry3d::Identity();

  const Eigen::Vector3d& Shoulder(Side side) const {
    return side == Side::kRight ? right_shoulder : left_shoulder;
  }
};
NominalStance StanceAt(const BodyPlacement& start, const ActionScript& script, double time_s);

}  // namespace holdfast
