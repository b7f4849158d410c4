// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/body/limb_ik.h"
#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Configuration of an arm for a given hand pose.
struct ArmChoice {
  double swivel_rad = 0.0;  ///< elbow rotation, up and outwards from hanging
  /// Sum of squares of swivel / 24 degrees, wrist flexion / 40, ulnar deviation from 8 / 22,
  /// forearm twist / 55: 1 is a noticeable angle. Much larger beyond the wrist's limits.
  double discomfort = 0.0;
  double hand_error_rad = 0.0;  ///< of the hand's rotation, from the wrist's limits
  double shortfall_m = 0.0;     ///< distance of the wrist from its target if the arm is too short
  LimbPose limb;
  WristPose wrist;
};

/// Target of an arm in one frame.
struct ArmTarget {
  Eigen::Vector3d shoulder = Eigen::Vector3d::Zero();       ///< world
  Eigen::Matrix3d chest = Eigen::Matrix3d::Identity();      ///< world rotation of spine3
  Eigen::Isometry3d wrist = Eigen::Isometry3d::Identity();  ///< world pose of the wrist joint
};

/// Inverse kinematics of an arm for a hand pose: two-bone inverse kinematics of shoulder, elbow and
/// wrist with a free elbow swivel; elbow and wrist share the forearm's twist (SolveWrist).
class ArmIk {
 public:
  /// `rest_joints` (3 x 55) is copied.
  ArmIk(Eigen::Matrix3Xd rest_joints, Side side);

  Side ArmSide() const { return side_; }
  const Eigen::Matrix3Xd& RestJoints() const { return rest_joints_; }
  const Limb& Bones() const { return limb_; }
  double Length() const { return longest_; }  ///< shoulder to wrist, nearly straight, meters

  /// Target for a wrist pose (world) of this body.
  ArmTarget TargetFor(const BodyPlacement& body, const Eigen::Isometry3d& wrist) const {
    return {body.joints.col(limb_.root), body.rotation[kSpine3], wrist};
  }
  /// Returns the arm with this swivel.
  ArmChoice At(const ArmTarget& target, double swivel_rad) const;
  /// Returns the arm with the swivel of least discomfort.
  ArmChoice Best(const ArmTarget& target) const;
  /// Returns one swivel per target, minimizing discomfort plus change over time: dynamic
  /// programming on a grid of 4 degrees, then Gaussian smoothing of 0.1 s.
  std::vector<double> Track(std::span<const ArmTarget> targets, double frame_rate) const;

 private:
  Eigen::Matrix3Xd rest_joints_;
  Side side_;
  Limb limb_;
  double longest_;
};

/// Path of one of `states` values per step that minimizes the sum of cost(step, state) and of
/// `change` times the squared difference between successive states.
std::vector<int> CheapestPath(int steps, int states, double change,
                              const std::function<double(int, int)>& cost);

/// Makes idle arms hang and swing, frame by frame: they hang lower than in the motion, and swing
/// opposite to the legs, each forward with the ankle of the other side, with a slightly bent elbow.
/// `idle` (left, right; 0 to 1) is the amount per arm, `walks` (0 to 1) the amount of swing. Smooth
/// in all of them.
void SwingArms(const Eigen::Matrix3Xd& rest_joints, const std::array<double, 2>& idle, double walks,
               BodyFrame& frame);

}  // namespace holdfast
