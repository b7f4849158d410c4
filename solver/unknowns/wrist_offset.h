// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/rotation.h"

namespace holdfast {

/// Pose of a hand relative to the clip's wrist, in the wrist frame.
struct WristOffset {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< meters

  /// This offset, followed by another one in the frame of the moved hand.
  WristOffset Compose(const WristOffset& next) const {
    return {(rotation * next.rotation).normalized(), translation + rotation * next.translation};
  }
  /// This offset scaled by `s`: 0 none, 1 all.
  WristOffset Scaled(double s) const {
    return {Eigen::Quaterniond(ExpSO3(s * LogSO3(rotation.toRotationMatrix()))), s * translation};
  }
  bool IsZero() const { return translation.isZero(0.0) && rotation.vec().isZero(0.0); }
};

/// Moves a hand of `pose` by an offset from its current pose; the arm follows (MoveWrist). Returns
/// the distance that the arm is too short, meters. A lone hand (BodyModel::LoneHand) has no arm:
/// its root rotates and `trans` changes, which is constant otherwise.
double MoveHand(const HandModel& hand, const WristOffset& offset, Eigen::Ref<Eigen::Vector3d> trans,
                JointPose& pose);

/// Offset that moves a hand of `pose` to a given world pose of its wrist.
WristOffset OffsetTo(const HandModel& hand, const Eigen::Isometry3d& wrist,
                     const Eigen::Vector3d& trans, const JointPose& pose);

}  // namespace holdfast
