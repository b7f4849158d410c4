// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"

namespace holdfast {

/// Free parameters of a frame's pose; the other joints keep their rest.
///
///   root (6)  world position of the pelvis minus its rest (meters), axis-angle of the root
///             (radians)
///   q (n)     3 per free joint (axis-angle, radians), in the order of `joints`; then h of each
///             hand, whose 45 finger parameters are rest + synergies h
class FreePose {
 public:
  struct Hand {
    Side side = Side::kRight;
    Eigen::MatrixXd synergies;  ///< (45 x m), radians per unit
    int column = 0;             ///< of its first entry in q; set by FreePose
  };

  FreePose() = default;
  FreePose(const JointPose& rest, std::vector<int> joints, std::vector<Hand> hands);

  static constexpr int kRootSize = 6;
  int Size() const { return size_; }
  const JointPose& Rest() const { return rest_; }
  const std::vector<int>& Joints() const { return joints_; }
  const std::vector<Hand>& Hands() const { return hands_; }
  /// Segments of q that belong together: one per joint, one per hand.
  struct Part {
    int column, size;
  };
  std::vector<Part> Parts() const;
  /// First of a joint's three columns in q; -1 if it is fixed or a finger's.
  int Column(int joint) const { return column_[static_cast<std::size_t>(joint)]; }
  JointPose Pose(const double* root, const double* q) const;
  /// q of a pose with the fingers at rest.
  Eigen::VectorXd Of(const JointPose& pose) const;

 private:
  JointPose rest_ = JointPose::Zero();
  std::vector<int> joints_;
  std::vector<Hand> hands_;
  std::array<int, kNumJoints> column_{};
  int size_ = 0;
};

/// A posed frame, with Jacobians of points that follow a joint by root, q and shape. Scratch.
class FreePoseState {
 public:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// `rest_joints` (3 x 55) as BodySurface::RestJoints. `with_jacobian`: also prepares the
  /// Jacobians.
  void Evaluate(const FreePose& free, const Eigen::Matrix3Xd& rest_joints, const double* root,
                const double* q, bool with_jacobian);

  const BodyState& Body() const { return body_; }
  Eigen::Vector3d Point(int joint, const Eigen::Vector3d& in_joint) const {
    return body_.joints.col(joint) + body_.world_rotation[joint] * in_joint;
  }
  /// d (point that follows `joint`, now at `world`) / d root (3 x 6).
  Eigen::Matrix<double, 3, 6> RootJacobian(const Eigen::Vector3d& world) const;
  /// Derivative by q: adds weight^T d point / d q to `J` (3 x n, zero elsewhere).
  void AddPoseJacobian(int joint, const Eigen::Vector3d& world, const Eigen::Matrix3d& weight,
                       Eigen::Ref<RowMajor> J) const;
  /// Derivative by shape: d joint / d betas (3 x B) from d rest joints / d betas (165 x B).
  Eigen::Matrix<double, 3, Eigen::Dynamic> ShapeJacobian(int joint,
                                                         const Eigen::MatrixXd& J_rest) const;

 private:
  const FreePose* free_ = nullptr;
  BodyState body_;
  Eigen::Matrix3d root_turn_;
  std::array<Eigen::Matrix3d, kNumJoints> turn_;  // world rotation vector by the joint's axis-angle
};

}  // namespace holdfast
