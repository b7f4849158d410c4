// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "geometry/robot/robot_hand.h"

namespace holdfast {

/// Forward kinematics of a hand: link poses and their derivatives. Scratch object, one per thread;
/// the hand must outlive it.
class RobotState {
 public:
  explicit RobotState(const RobotHand& hand);

  /// Computes the poses of all links for the configuration `q` (NumDofs).
  void Evaluate(const Eigen::Ref<const Eigen::VectorXd>& q);

  const RobotHand& Hand() const { return *hand_; }
  const Eigen::Isometry3d& RootFromLink(int link) const { return root_from_link_[link]; }

  /// A joint that moves a link: its degree of freedom, and the twist of all attached links per unit
  /// of it, in the root's frame (angular velocity, then the linear velocity at the origin).
  struct Column {
    int dof;
    Eigen::Matrix<double, 6, 1> twist;
  };
  /// Moving joints from the root out to `link`; a degree of freedom may occur more than once.
  const std::vector<int>& Chain(int link) const { return chains_[link]; }
  /// The column of the joint that moves `link` (an entry of Chain).
  const Column& ColumnOf(int link) const { return columns_[link]; }

  /// Jacobian d point / d q (3 x dofs) of the `point` fixed to `link`, in the root's frame.
  Eigen::Matrix3Xd PointJacobian(int link, const Eigen::Vector3d& point) const;

 private:
  const RobotHand* hand_;
  std::vector<Eigen::Isometry3d> root_from_link_;
  std::vector<std::vector<int>> chains_;
  std::vector<Column> columns_;
};

/// Closed meshes of the primitive shapes of robot files, centered at the origin; meters. Cylinders
/// and capsules are along z; a capsule's `length` excludes its end caps.
TriangleMesh BoxMesh(const Eigen::Vector3d& size);
TriangleMesh BallMesh(double radius);
TriangleMesh CylinderMesh(double radius, double length);
TriangleMesh CapsuleMesh(double radius, double length);
/// Returns an ellipsoid with these semi-axes.
TriangleMesh EllipsoidMesh(const Eigen::Vector3d& semi_axes);

/// Throws Error (`source`) unless the sizes of a link's shape are finite, above zero (the `length`
/// of a capsule may be zero) and below 100 m.
void RequireShapeSize(const std::string& source, const std::string& link,
                      const Eigen::Ref<const Eigen::VectorXd>& sizes);

/// Returns the mesh with transformed vertices; faces are flipped if the transform mirrors.
TriangleMesh Transformed(const TriangleMesh& mesh, const Eigen::Affine3d& transform);

/// Resolves the mesh `name` in the robot file at `robot`: relative to the file's folder, or for
/// package:// in the nearest parent folder that has it. Throws Error if it is missing.
std::filesystem::path FindRobotMesh(const std::filesystem::path& robot, const std::string& name);

}  // namespace holdfast
