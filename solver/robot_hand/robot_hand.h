// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"

/// A robot's hand: a URDF or MJCF goes in; a tree of links, the numbers that move them, and where
/// links are for given numbers come out.

namespace holdfast {

enum class RobotJointKind { kFixed, kTurning, kSliding };

/// A link and the joint that moves it. Values of joints are radians or meters.
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

/// A robot's hand as a tree of rigid links: parents before children, lengths in meters. Joints that
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

/// A joint as a robot's file has it, before followers are resolved.
struct RobotJointSource {
  std::string name;
  std::string follows;  ///< another joint's name; empty: it moves on its own
  double factor = 1.0, offset = 0.0;
  double low = 0.0, high = 0.0;
};

/// Gives the links (with `joint` and `kind` set) their numbers: one for each joint that moves on
/// its own, with bounds narrowed to what its followers allow. Joints without range stand still;
/// bounds wider than a turn or a meter are narrowed, with a note. Throws Error (`hand.source`) for
/// a joint that follows itself or one that is not there, for numbers that are not finite, a lower
/// bound above the upper, and bounds that leave nothing.
void ResolveJoints(std::vector<RobotJointSource> joints, RobotHand& hand);

/// Reads a robot hand: URDF (`.urdf`, by urdfdom) or MJCF (`.xml`, by MuJoCo). Mesh files (.obj,
/// .stl, .ply, .off) are looked for beside the file, as it names them, and `package://name/...` in
/// the folders above it. What a link shows is its shape; what collides, where it shows nothing.
/// Limits are the file's; joints without any turn freely within a turn. The file is checked first
/// (CheckRobotFile), and its library runs in a process of its own (ReadInProcess).
///
/// Throws Error for a file that is neither, is not well-formed, has no joint that moves or more
/// than 200 that move on their own; for what CheckRobotFile and ReadInProcess refuse; for meshes
/// that are missing or cannot be read; for mimics of joints that are not there; for a hand larger
/// than 2 m or smaller than 2 cm (a file in millimeters); and where this build has no library for
/// the format.
RobotHand ReadRobotHand(const std::filesystem::path& path);

/// The readers of each format, in this process and without any of these checks. `text`: the file's.
RobotHand ReadUrdf(const std::filesystem::path& path, const std::string& text);
RobotHand ReadMjcf(const std::filesystem::path& path);

}  // namespace holdfast
