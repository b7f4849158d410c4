// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/nearest.h"
#include "geometry/score/object_symmetry.h"

namespace holdfast {

/// How far one pose of an object is from another.
struct ObjectPoseError {
  double translation_mm = 0.0;       ///< distance of the two places of the object's centre
  double rotation_deg = 0.0;         ///< angle between the rotations
  double rotation_modulo_deg = 0.0;  ///< least angle over the object's symmetries
  double add_mm = 0.0;               ///< mean over vertices of |A x - B x| (Hinterstoisser 2012)
  double add_s_mm = 0.0;  ///< mean over vertices of the distance of A x to the nearest B y: no
                          ///< correspondence, for symmetric objects
};

/// Compares poses of one object. Const after construction and shareable.
class ObjectPoseComparer {
 public:
  /// Of the mesh in the object's own frame: all its vertices are compared. Throws Error for a mesh
  /// without area.
  ObjectPoseComparer(const TriangleMesh& mesh, ObjectSymmetry symmetry);

  ObjectPoseError Compare(const Eigen::Isometry3d& world_from_object,
                          const Eigen::Isometry3d& reference_world_from_object) const;

  double Diameter_m() const { return diameter_m_; }
  const ObjectSymmetry& Symmetry() const { return symmetry_; }

 private:
  Eigen::Matrix3Xd vertices_;
  ObjectSymmetry symmetry_;
  NearestPoints nearest_;
  double diameter_m_;
};

}  // namespace holdfast
