// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Landmarks of a head to which objects are brought. Frame: that of the head joint in the rest
/// pose, origin at the joint, y up, z forward, x to the person's left; meters.
struct FaceMarks {
  Eigen::Vector3d eyes = Eigen::Vector3d(0.0, 0.05, 0.09);        ///< midpoint of the eyes
  Eigen::Vector3d mouth = Eigen::Vector3d(0.0, -0.01, 0.1);       ///< on the skin
  Eigen::Vector3d right_ear = Eigen::Vector3d(-0.08, 0.04, 0.0);  ///< outermost point, on the skin
  TriangleMesh head;  ///< skin of the head and upper neck, closed at the bottom
};

/// Finds the landmarks on the skin of the rest pose. The tip of the nose is the foremost midline
/// point above the head joint; the mouth is 1.2 times as far below it as the eyes are above it; the
/// ear is the outermost point within 2 cm below the eyes. `body` is a whole body. Throws Error if
/// it has no head.
FaceMarks FindFaceMarks(const BodySurface& body);

/// Landmarks of an object that actions need, in the object frame (z up when standing), meters. The
/// frames of the embedded objects are described in meshes/objects/README.md.
struct ObjectMarks {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of the bounding box
  Eigen::Vector3d size = Eigen::Vector3d::Zero();    ///< of the bounding box
  Eigen::Vector3d rim = Eigen::Vector3d::Zero();     ///< center of the top edge
  double rim_radius = 0.0;
  /// The functional point: where light exits, the bitten point, the striking point, the spout.
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();
  Eigen::Vector3d forward = Eigen::Vector3d::UnitX();  ///< unit: direction in which the tip points
  Eigen::Vector3d facing = Eigen::Vector3d::UnitZ();   ///< unit: of edge, bristles, lens, screen
  /// Lies on either of two sides. Half a turn about the x axis leaves the held part unchanged, such
  /// as a hammer's handle; the hammer's face is then on the other side of the hand (TurnedOver).
  bool two_sided = false;
};

/// Half a turn about the x axis of the object frame.
Eigen::Isometry3d TurnedOver();

/// Returns the landmarks of an embedded object by name; other objects get those of their bounding
/// box and rim. `mesh` is not mirrored: for a mirrored mesh, mirror the result (ReflectX).
ObjectMarks MarksOf(std::string_view name, const TriangleMesh& mesh);

/// Mirrors an object, or its landmarks, at x = 0 of the object frame.
TriangleMesh ReflectX(const TriangleMesh& mesh);
ObjectMarks ReflectX(const ObjectMarks& marks);

/// A point of an object and the point at the head that an action brings it to.
struct FacePlace {
  Eigen::Vector3d mark = Eigen::Vector3d::Zero();   ///< object frame, meters
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< head frame (FaceMarks), meters
};

/// Returns the target of the action scripts (WriteDrink etc.) for an object at `head_from_object`:
/// drink and toast: nearest rim point to the lips; eat: an end of a long object, or the near side
/// of any other, to the mouth; call: upper end of the phone to the right ear; takepicture: middle
/// of the object to the line of sight, at its present distance within bounds; brush: bristles to
/// the teeth. Returns nullopt for actions away from the face.
std::optional<FacePlace> FacePlaceOf(std::string_view action, const ObjectMarks& object,
                                     const FaceMarks& face,
                                     const Eigen::Isometry3d& head_from_object);

}  // namespace holdfast
