// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/rotation.h"

namespace holdfast {

/// Where a hand is relative to the wrist of the clip, in the clip's wrist frame.
struct WristOffset {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< meters

  /// This offset, then another one in the frame of the hand that it has moved.
  WristOffset Compose(const WristOffset& next) const {
    return {(rotation * next.rotation).normalized(), translation + rotation * next.translation};
  }
  /// The share `s` of it: 0 none, 1 all.
  WristOffset Scaled(double s) const {
    return {Eigen::Quaterniond(ExpSO3(s * LogSO3(rotation.toRotationMatrix()))), s * translation};
  }
  bool IsZero() const { return translation.isZero(0.0) && rotation.vec().isZero(0.0); }
};

/// Moves a hand of `pose` by an offset from where it is; the arm follows (MoveWrist). Returns the
/// distance that the arm is too short, meters. A hand that hangs on no body (BodyModel::LoneHand)
/// goes there itself: its root turns and `trans` changes, which stays what it is otherwise.
double MoveHand(const HandModel& hand, const WristOffset& offset, Eigen::Ref<Eigen::Vector3d> trans,
                JointPose& pose);

/// The offset that brings a hand of `pose` to a world pose of its wrist.
WristOffset OffsetTo(const HandModel& hand, const Eigen::Isometry3d& wrist,
                     const Eigen::Vector3d& trans, const JointPose& pose);

}  // namespace holdfast
