// SPDX-License-Identifier: MIT
#pragma once

#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "solver/fit/fit.h"
#include "solver/fit/hand_object_block.h"

namespace holdfast::testing {

/// `count` points on an ellipsoid of a bottle's size (3 x count), evenly spread, object frame,
/// meters.
inline Eigen::Matrix3Xd EllipsoidPoints(int count) {
  Eigen::Matrix3Xd points(3, count);
  for (int k = 0; k < count; ++k) {
    const double z = 1.0 - (2.0 * k + 1.0) / count;
    const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * k;
    const double r = std::sqrt(1.0 - z * z);
    points.col(k) =
        Eigen::Vector3d(0.035 * r * std::cos(angle), 0.03 * r * std::sin(angle), 0.08 * z);
  }
  return points;
}

/// A hand of the embedded body.
inline const HandModel& DefaultHand(Side side) {
  static const HandModel right(BodyModel::Default(), {}, Side::kRight);
  static const HandModel left(BodyModel::Default(), {}, Side::kLeft);
  return side == Side::kRight ? right : left;
}

/// A person with a bent arm and curled fingers, and an object in the palm.
struct HandScene {
  explicit HandScene(Side side = Side::kRight)
      : model(BodyModel::Default()), hand(model, {}, side), object(EllipsoidPoints(300)) {
    const double mirror = side == Side::kRight ? 1.0 : -1.0;
    pose.setZero();
    pose.col(0) = Eigen::Vector3d(std::numbers::pi / 2, 0, 0);
    pose.col(side == Side::kRight ? 17 : 16) = Eigen::Vector3d(0.1, 0.3 * mirror, 0.9 * mirror);
    pose.col(side == Side::kRight ? 19 : 18) = Eigen::Vector3d(0.0, 0.8 * mirror, 0.0);
    for (int k = 0; k < 12; ++k)
      pose.col(HandBegin(side) + k) = Eigen::Vector3d(0, 0, 0.6 * mirror);
    trans = Eigen::Vector3d(0.1, -0.2, 0.9);
    HandState state(hand);
    state.SetBody(pose, trans);
    state.Evaluate(FingersOf(pose, side), false);
    const Eigen::Vector3d palm = 0.5 * (state.WristPosition() + state.JointPositions().col(4));
    object_pose.orientation =
        Eigen::Quaterniond(state.WristRotation()) *
        Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()));
    object_pose.translation =
        palm + state.WristRotation() * Eigen::Vector3d(-0.02 * mirror, -0.05, 0.01);
  }

  std::shared_ptr<const BodyModel> model;
  HandModel hand;
  Eigen::Matrix3Xd object;
  JointPose pose;
  Eigen::Vector3d trans;
  ObjectPose object_pose;
};

}  // namespace holdfast::testing
