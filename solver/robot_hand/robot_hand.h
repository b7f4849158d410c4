// SPDX-License-Identifier: MIT
#pragma once

/// A robot's hand: a URDF or MJCF goes in; a tree of links, the numbers that move them, and where
/// links are for given numbers come out.

#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"

namespace holdfast {

enum class RobotJointKind { kFixed, kTurning, kSliding };

/// A link and the joint that moves it. Values of joints are radians or metres.
struct RobotLink {
  std::string name;
  int parent = -1;  ///< an earlier link; -1: the root
  std::string joint;
  RobotJointKind kind = RobotJointKind::kFixed;
  Eigen::Isometry3d parent_from_joint = Eigen::Isometry3d::Identity();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit, in the joint's (and link's) frame
  /// The joint's value is `factor` times the hand's number `dof`, plus `offset`; -1: it is `offset`
  /// (fixed, or without range).
  int dof = -1;
  double factor = 1.0, offset = 0.0;
  std::vector<TriangleMesh> shapes;  ///< what is seen (else what collides), in the link's frame
};

/// A number that moves a hand, with the bounds that all joints it moves allow.
struct RobotDof {
  std::string name;  ///< of the joint that it belongs to
  double low = 0.0, high = 0.0;
};

/// A robot's hand as a tree of rigid links: parents before children, lengths in metres. Joints that
/// follow others (URDF's mimic, MJCF's joint equalities) have no number of their own.
struct RobotHand {
  std::string name;
  std::string source;  ///< the file
  std::vector<RobotLink> links;
  std::vector<RobotDof> dofs;
  std::vector<std::string> notes;  ///< what was left out or mended, plain sentences

  int NumLinks() const { return static_cast<int>(links.size()); }
  int NumDofs() const { return static_cast<int>(dofs.size()); }
  /// Each number at 0, or at the bound that is nearest to it: fingers of most hands are straight.
  Eigen::VectorXd Straight() const;
  /// Each number within its bounds.
  Eigen::VectorXd Clamped(const Eigen::VectorXd& q) const;
  /// -1 where there is none of that name.
  int FindLink(const std::string& link) const;
};

}  // namespace holdfast
