// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"

namespace holdfast {

/// Which numbers of a frame's pose are solved for; the other joints keep their rest.
///
///   root (6)  world position of the pelvis less its rest (meters), axis-angle of the root
///   (radians) q (n)     three numbers a free joint (axis-angle, radians), in the order of
///   `joints`; then the
///             numbers h of each hand: its 45 finger numbers are rest + synergies h
class FreePose {
 public:
  struct Hand {
    Side side = Side::kRight;
    Eigen::MatrixXd synergies;  ///< (45 x m), radians a unit
    int column = 0;             ///< of its first number in q; set by FreePose
  };

  FreePose() = default;
  FreePose(const JointPose& rest, std::vector<int> joints, std::vector<Hand> hands);

  static constexpr int kRootSize = 6;
  int Size() const { return size_; }
  const JointPose& Rest() const { return rest_; }
  const std::vector<int>& Joints() const { return joints_; }
  const std::vector<Hand>& Hands() const { return hands_; }
  /// Runs of q that belong together: each joint's three numbers, each hand's numbers.
  struct Part {
    int column, size;
  };
  std::vector<Part> Parts() const;
  /// First of a joint's three columns in q; -1 where it is not free or a finger's.
  int Column(int joint) const { return column_[static_cast<std::size_t>(joint)]; }
  JointPose Pose(const double* root, const double* q) const;
  /// q of a pose whose fingers are at rest.
  Eigen::VectorXd Of(const JointPose& pose) const;

 private:
  JointPose rest_ = JointPose::Zero();
  std::vector<int> joints_;
  std::vector<Hand> hands_;
  std::array<int, kNumJoints> column_{};
  int size_ = 0;
};

/// A frame posed, and how points that follow a joint move with root, q and shape. Scratch.
class FreePoseState {
 public:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// `rest_joints` (3 x 55) as BodySurface::RestJoints. With `with_jacobian` what the Jacobians
  /// need.
  void Evaluate(const FreePose& free, const Eigen::Matrix3Xd& rest_joints, const double* root,
                const double* q, bool with_jacobian);

  const BodyState& Body() const { return body_; }
  Eigen::Vector3d Point(int joint, const Eigen::Vector3d& in_joint) const {
    return body_.joints.col(joint) + body_.world_rotation[joint] * in_joint;
  }
  /// d (point that follows `joint`, at `world` now) / d root (3 x 6).
  Eigen::Matrix<double, 3, 6> RootJacobian(const Eigen::Vector3d& world) const;
  /// The same by q: adds weight^T d point / d q to `J` (3 x n, zero elsewhere).
  void AddPoseJacobian(int joint, const Eigen::Vector3d& world, const Eigen::Matrix3d& weight,
                       Eigen::Ref<RowMajor> J) const;
  /// The same by shape: d joint / d betas (3 x B) for d rest joints / d betas (165 x B).
  Eigen::Matrix<double, 3, Eigen::Dynamic> ShapeJacobian(int joint,
                                                         const Eigen::MatrixXd& J_rest) const;

 private:
  const FreePose* free_ = nullptr;
  BodyState body_;
  Eigen::Matrix3d root_turn_;
  std::array<Eigen::Matrix3d, kNumJoints> turn_;  // world rotation vector by the joint's axis-angle
};

}  // namespace holdfast
