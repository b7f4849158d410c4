// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "geometry/body/skeleton.h"

namespace holdfast {

/// Changes of trunk, reaching arm and head in one frame, relative to the captured frame:
///
///   0-2    pelvis translation (world, meters)
///   3-5    pelvis rotation    6-8, 9-11, 12-14  spine1, spine2, spine3
///   15-17  collar of the arm  18-20  shoulder   21  elbow flexion
///   22-24  neck               25-27  head
///
/// Rotations R_j = S_j exp(x_j) with S_j captured, radians; the elbow rotates about its hinge. The
/// legs follow by inverse kinematics and are not part of this; the other arm moves along.
struct UpperBodyDofs {
  static constexpr int kPelvisMove = 0, kPelvisTurn = 3, kSpine = 6, kCollar = 15, kShoulder = 18,
                       kElbow = 21, kNeck = 22, kHead = 25, kSize = 28;
};
using UpperBodyChange = Eigen::Matrix<double, UpperBodyDofs::kSize, 1>;
/// Standard deviation of each degree of freedom, meters and radians: large for the arm, smaller for
/// the trunk; `head_turn` for neck and head.
UpperBodyChange UpperBodySigma(const Eigen::Vector3d& pelvis_move, double pelvis_turn,
                               double head_turn);
using J_point_change = Eigen::Matrix<double, 3, UpperBodyDofs::kSize>;

/// Pelvis, trunk, one arm and head: constants of the body, and application of changes to frames.
class UpperBodyChain {
 public:
  UpperBodyChain(const Eigen::Matrix3Xd& rest_joints, Side wrist);

  Side Wrist() const { return wrist_; }
  const Eigen::Matrix3Xd& RestJoints() const { return rest_joints_; }
  const Eigen::Vector3d& ElbowHinge() const { return hinge_; }
  int CollarJoint() const { return collar_; }
  int ShoulderJoint() const { return collar_ + 3; }
  int ElbowJoint() const { return collar_ + 5; }
  int WristJointId() const { return collar_ + 7; }

  /// Returns `frame` with the change applied.
  BodyFrame Changed(const BodyFrame& frame, const UpperBodyChange& change) const;
  /// Flexion of the elbow about its hinge, radians.
  double ElbowFlexion(const BodyFrame& frame) const;

 private:
  Eigen::Matrix3Xd rest_joints_;
  Side wrist_;
  int collar_;
  Eigen::Vector3d hinge_;
};

/// A changed frame with the data for its terms: world positions and directions, and the derivatives
/// of pelvis, spine, arm and head by the change. Scratch: one per thread.
class UpperBodyState {
 public:
  void Evaluate(const UpperBodyChain& chain, const BodyFrame& captured,
                const UpperBodyChange& change);

  const BodyPlacement& Placed() const { return placed_; }
  /// d position of a joint / d change. Joints 0-3, 6, 9, 12, 15 and the arm's, not legs below hips.
  J_point_change PointJacobian(int joint) const;
  /// d (direction fixed in a joint's frame, now `world`) / d change. Joints as above.
  J_point_change DirectionJacobian(int joint, const Eigen::Vector3d& world) const;

 private:
  struct Turn {
    int joint, column, size;
    Eigen::Matrix3d J_omega_change;  // world rotation vector by change (one column for the elbow)
  };

  BodyPlacement placed_;
  std::array<Turn, 9> turns_;
};

}  // namespace holdfast
