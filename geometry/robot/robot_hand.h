// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"

/// Robot hands, and objects of several links: reads a URDF or MJCF file into a tree of links with
/// their degrees of freedom and forward kinematics.

namespace holdfast {

enum class RobotJointKind { kFixed, kTurning, kSliding };

/// A link and the joint that moves it. Joint values are in radians or meters.
struct RobotLink {
  std::string name;
  int parent = -1;  ///< index of an earlier link; -1 for the root
  std::string joint;
  RobotJointKind kind = RobotJointKind::kFixed;
  Eigen::Isometry3d parent_from_joint = Eigen::Isometry3d::Identity();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit, in the joint's (and link's) frame
  /// The joint value is `factor * q[dof] + offset`. If `dof` is -1, the joint value is `offset` (a
  /// fixed joint, or one without range).
  int dof = -1;
  double factor = 1.0, offset = 0.0;
  std::vector<TriangleMesh> shapes;  ///< visual (else collision) meshes, in the link's frame
};

/// A degree of freedom of a hand, with bounds that satisfy all joints it moves.
struct RobotDof {
  std::string name;  ///< name of its joint
  double low = 0.0, high = 0.0;
};

/// A robot hand as a tree of rigid links: parents precede children, lengths are in meters. Joints
/// that follow others (URDF mimic, MJCF joint equalities) have no degree of freedom of their own.
struct RobotHand {
  std::string name;
  std::string source;  ///< path of the file
  std::vector<RobotLink> links;
  std::vector<RobotDof> dofs;
  std::vector<std::string> notes;  ///< what was omitted or repaired, as plain sentences

  int NumLinks() const { return static_cast<int>(links.size()); }
  int NumDofs() const { return static_cast<int>(dofs.size()); }
  /// Each value at 0, or at its nearest bound: most hands then have straight fingers.
  Eigen::VectorXd Straight() const;
  /// Returns `q` clamped to the bounds.
  Eigen::VectorXd Clamped(const Eigen::VectorXd& q) const;
  /// Returns the index of a link, or -1 if there is none of that name.
  int FindLink(const std::string& link) const;
};

/// A joint as given in a robot file, before mimic joints are resolved.
struct RobotJointSource {
  std::string name;
  std::string follows;  ///< name of the joint it follows; empty if it is independent
  double factor = 1.0, offset = 0.0;
  double low = 0.0, high = 0.0;
};

/// Assigns degrees of freedom to the links (whose `joint` and `kind` are set): one per independent
/// joint, with bounds narrowed to satisfy its followers. Joints without range become fixed. Bounds
/// wider than a full turn or a meter are narrowed, with a note. Throws Error (`hand.source`) for a
/// joint that follows itself or a missing joint, for values that are not finite, for a lower bound
/// above the upper one, and for an empty range.
void ResolveJoints(std::vector<RobotJointSource> joints, RobotHand& hand);

/// Whether the path ends in .urdf, .xml or .mjcf, in any case.
bool HasRobotFormat(const std::filesystem::path& path);

/// Reads the tree of links of a URDF (`.urdf`, with urdfdom) or MJCF file (`.xml`, with MuJoCo), of
/// a hand or of an object. Mesh files (.obj, .stl, .ply, .off; URDF: .dae) are resolved relative to
/// the file, and `package://name/...` in its parent folders. A link's shape is its visual geometry,
/// or its collision geometry if it has no visual one. Joint limits are those of the file; joints
/// without limits may turn by half a turn in each direction. The file is checked first
/// (CheckRobotFile), and the library runs in a separate process (ReadInProcess).
///
/// Throws Error for a file that has neither format, is not well-formed, or has more than 200
/// independent joints; if CheckRobotFile or ReadInProcess fails; for meshes that are missing or
/// unreadable; for mimics of missing joints; for numbers that are not finite; and if this build
/// lacks the library for the format.
RobotHand ReadLinks(const std::filesystem::path& path);

/// ReadLinks of a hand. Throws Error as well if no joint moves, and for a hand larger than 2 m or
/// smaller than 2 cm (a file in millimeters).
RobotHand ReadRobotHand(const std::filesystem::path& path);

/// The shapes of all links in the pose of Straight(), as one mesh in the root's frame, in meters.
TriangleMesh MeshOfLinks(const RobotHand& robot);

/// Format-specific readers, in this process, without these checks. `text`: the file's contents.
RobotHand ReadUrdf(const std::filesystem::path& path, const std::string& text);
RobotHand ReadMjcf(const std::filesystem::path& path);

}  // namespace holdfast
