// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/body/limb_ik.h"
#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// An arm that has its hand at a given pose.
struct ArmChoice {
  double swivel_rad = 0.0;  ///< elbow's way up and out from where it hangs
  /// Sum of squares of swivel / 24 degrees, wrist flexion / 40, ulnar deviation from 8 / 22,
  /// forearm twist / 55: 1 is what one angle is when it is felt. Beyond the wrist's limits far
  /// more.
  double discomfort = 0.0;
  double hand_error_rad = 0.0;  ///< of the hand's rotation: the wrist's limits
  double shortfall_m = 0.0;     ///< how far the wrist stays from its target: the arm is too short
  LimbPose limb;
  WristPose wrist;
};

/// What an arm is asked in one frame.
struct ArmTarget {
  Eigen::Vector3d shoulder = Eigen::Vector3d::Zero();       ///< world
  Eigen::Matrix3d chest = Eigen::Matrix3d::Identity();      ///< world rotation of spine3
  Eigen::Isometry3d wrist = Eigen::Isometry3d::Identity();  ///< world pose of the wrist joint
};

/// Inverse kinematics of an arm: shoulder, elbow and wrist for a hand at a given pose, by two-bone
/// inverse kinematics with the elbow's swivel free, the forearm's twist shared by elbow and wrist
/// (SolveWrist).
class ArmIk {
 public:
  /// `rest_joints` (3 x 55) is copied.
  ArmIk(Eigen::Matrix3Xd rest_joints, Side side);

  Side ArmSide() const { return side_; }
  const Eigen::Matrix3Xd& RestJoints() const { return rest_joints_; }
  const Limb& Bones() const { return limb_; }
  double Length() const { return longest_; }  ///< shoulder to wrist, nearly straight, meters

  /// The arm with this swivel.
  ArmChoice At(const ArmTarget& target, double swivel_rad) const;
  /// The swivel of least discomfort.
  ArmChoice Best(const ArmTarget& target) const;
  /// Swivels over time with least discomfort and least change together: dynamic programming over a
  /// grid of 4 degrees, then a bell of 0.1 s. One for each target.
  std::vector<double> Track(std::span<const ArmTarget> targets, double frame_rate) const;

 private:
  Eigen::Matrix3Xd rest_joints_;
  Side side_;
  Limb limb_;
  double longest_;
};

/// Arms that have nothing else to do, frame by frame: they hang more than the motion has it, and
/// swing against the legs, each forward with the ankle of the other side, bending a little there.
/// `idle` (left, right; 0 to 1) says how much of it an arm does, `walks` (0 to 1) how much swing
/// there is. Smooth in all of them.
void SwingArms(const Eigen::Matrix3Xd& rest_joints, const std::array<double, 2>& idle, double walks,
               BodyFrame& frame);

}  // namespace holdfast
