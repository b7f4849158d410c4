// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// What an action must know of an object, in the object's frame (z up as it stands), metres. The
/// embedded objects' frames are written in meshes/objects/README.md.
struct ObjectMarks {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of the bounding box
  Eigen::Vector3d size = Eigen::Vector3d::Zero();    ///< of the bounding box
  Eigen::Vector3d rim = Eigen::Vector3d::Zero();     ///< middle of the highest edge
  double rim_radius = 0.0;
  /// What the action is done with: where light leaves, what is bitten, what strikes, the spout.
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();
  Eigen::Vector3d forward = Eigen::Vector3d::UnitX();  ///< unit: where the tip points
  Eigen::Vector3d facing = Eigen::Vector3d::UnitZ();   ///< unit: edge, bristles, lens, screen
  bool round = false;  ///< the same from all sides about z: its turn about z is nobody's wish
  /// It lies on either of two sides, and half a turn about its x axis leaves what a hand holds as
  /// it was: a hammer's handle, whose face is then on the other side of the hand (TurnedOver).
  bool two_sided = false;
};

/// The object turned over: half a turn about its x axis, in its own frame.
Eigen::Isometry3d TurnedOver();

/// Marks of an object by its embedded name; other objects have those of their bounding box and rim.
/// `mesh` as the object's own: reflect the marks (ReflectX) where the mesh is.
ObjectMarks MarksOf(std::string_view name, const TriangleMesh& mesh);

/// The object, or its marks, in a mirror at x = 0 of its own frame.
TriangleMesh ReflectX(const TriangleMesh& mesh);
ObjectMarks ReflectX(const ObjectMarks& marks);

}  // namespace holdfast
