// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "solver/robot_hand/robot_hand.h"

namespace holdfast {

/// Where the links of a hand are, and how they move with its numbers. Scratch, one per thread; the
/// hand must outlive it.
class RobotState {
 public:
  explicit RobotState(const RobotHand& hand);

  /// Poses of all links for these numbers (one for each of the hand's).
  void Evaluate(const Eigen::Ref<const Eigen::VectorXd>& q);

  const RobotHand& Hand() const { return *hand_; }
  const Eigen::Isometry3d& RootFromLink(int link) const {
    return root_from_link_[static_cast<std::size_t>(link)];
  }

  /// A joint that moves a link: its number, and the twist of all that hangs on it, in the root's
  /// frame, a unit of that number (angular, then the velocity at the root's origin).
  struct Column {
    int dof;
    Eigen::Matrix<double, 6, 1> twist;
  };
  /// Those between root and link, from the root outwards; a number may come more than once.
  const std::vector<int>& Chain(int link) const { return chains_[static_cast<std::size_t>(link)]; }
  /// The column of the joint that moves `link` (an entry of Chain).
  const Column& ColumnOf(int link) const { return columns_[static_cast<std::size_t>(link)]; }

  /// d (point fixed to `link`, at `point` now) / d q (3 x dofs), root's frame.
  Eigen::Matrix3Xd PointJacobian(int link, const Eigen::Vector3d& point) const;

 private:
  const RobotHand* hand_;
  std::vector<Eigen::Isometry3d> root_from_link_;
  std::vector<std::vector<int>> chains_;
  std::vector<Column> columns_;
};

/// Closed meshes of the primitives that robots are made of, about the origin; meters. Cylinders and
/// capsules stand along z, `length` without a capsule's ends.
TriangleMesh BoxMesh(const Eigen::Vector3d& size);
TriangleMesh BallMesh(double radius);
TriangleMesh CylinderMesh(double radius, double length);
TriangleMesh CapsuleMesh(double radius, double length);
/// An ellipsoid with these semi-axes.
TriangleMesh EllipsoidMesh(const Eigen::Vector3d& semi_axes);

/// Throws Error (`source`) unless the numbers of a link's shape are finite, above zero (`length` of
/// a capsule may be zero) and below 100 m.
void RequireShapeSize(const std::string& source, const std::string& link,
                      const Eigen::Ref<const Eigen::VectorXd>& sizes);

/// The mesh with its vertices moved; faces turn where the transform mirrors.
TriangleMesh Transformed(const TriangleMesh& mesh, const Eigen::Affine3d& transform);

/// Where a robot's file at `robot` means the mesh `name` to be: beside it, or for package:// in the
/// nearest folder above that has it. Throws Error where it is not.
std::filesystem::path FindRobotMesh(const std::filesystem::path& robot, const std::string& name);

}  // namespace holdfast
