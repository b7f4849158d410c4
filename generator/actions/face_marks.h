// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Places on a head that objects are brought to. Frame: that of the head joint in the rest pose,
/// origin at the joint, y up, z where the face looks, x to the person's left; meters.
struct FaceMarks {
  Eigen::Vector3d eyes = Eigen::Vector3d(0.0, 0.05, 0.09);        ///< between both
  Eigen::Vector3d mouth = Eigen::Vector3d(0.0, -0.01, 0.1);       ///< on the skin
  Eigen::Vector3d right_ear = Eigen::Vector3d(-0.08, 0.04, 0.0);  ///< on the skin, outermost
  TriangleMesh head;  ///< skin of head and upper neck, closed below
};

/// Finds the marks on the skin of the rest pose. The tip of the nose is what is foremost on the
/// midline above the head joint; the mouth is as far below it as 1.2 times the eyes are above; the
/// ear is what is outermost within 2 cm below the eyes. `body` is a whole body. Throws Error for
/// one without a head.
FaceMarks FindFaceMarks(const BodySurface& body);

/// What an action must know of an object, in the object's frame (z up as it stands), meters. The
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
  bool round = false;  ///< the same from all sides about z: it is rotationally symmetric about z
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

/// A place of an object and the place at the head that an action brings it to.
struct FacePlace {
  Eigen::Vector3d mark = Eigen::Vector3d::Zero();   ///< object's frame, meters
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< head's frame (FaceMarks), meters
};

/// What the scripts of the actions ask for (WriteDrink and the others), for an object that is
/// where `head_from_object` has it: drink and toast, the rim's nearest place to the lips; eat, an
/// end of something long, the near side of anything else to the mouth; call, the phone's upper end
/// to the right ear; takepicture, the middle to the line of sight, as far off as it is, within
/// bounds; brush, the bristles to the teeth. Nothing for actions that bring nothing to the face.
std::optional<FacePlace> FacePlaceOf(std::string_view action, const ObjectMarks& object,
                                     const FaceMarks& face,
                                     const Eigen::Isometry3d& head_from_object);

}  // namespace holdfast
