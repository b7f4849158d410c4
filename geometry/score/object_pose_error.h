// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/nearest.h"

namespace holdfast {

/// The rotations about `center` that map an object's surface onto itself: poses R and R S are
/// indistinguishable by shape. Mirror images are excluded: no rigid motion produces one.
struct ObjectSymmetry {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< object's frame, meters
  /// The finite part, the identity first. With an axis: one representative of each class (the
  /// identity, and the half turn that swaps the ends if it is a symmetry).
  std::vector<Eigen::Matrix3d> rotations = {Eigen::Matrix3d::Identity()};
  std::optional<Eigen::Vector3d> axis;  ///< unit; any rotation about it is a symmetry
  bool sphere = false;                  ///< whether any rotation is a symmetry
  /// Largest distance of a surface point from the surface under any of the symmetries, mm.
  double deviation_mm = 0.0;

  bool Any() const { return sphere || axis || rotations.size() > 1; }
};

/// Detects rotational symmetries. Tests the axes of inertia, all axes perpendicular to one of them
/// if two moments are equal, and all axes if three are equal; rotations by any angle, and by 1/2
/// ... 1/6 of a turn. The result is closed under composition. Throws Error for a mesh without area.
ObjectSymmetry DetectSymmetry(const TriangleMesh& mesh);

/// Returns e.g. "none", "any turn about (0, 0, 1), ends alike", "4 rotations", "any rotation".
std::string Describe(const ObjectSymmetry& symmetry);

/// Minimum angle (radians) between R_a and R_b S over all symmetries S.
double AngleModulo(const Eigen::Matrix3d& R_a, const Eigen::Matrix3d& R_b,
                   const ObjectSymmetry& symmetry);

/// Error of one pose of an object relative to another.
struct ObjectPoseError {
  double translation_mm = 0.0;       ///< distance between the two positions of the object's center
  double rotation_deg = 0.0;         ///< angle between the rotations
  double rotation_modulo_deg = 0.0;  ///< minimum angle over the object's symmetries
  double add_mm = 0.0;               ///< mean over vertices of |A x - B x| (Hinterstoisser 2012)
  double add_s_mm = 0.0;  ///< mean over vertices of the distance of A x to the nearest B y, without
                          ///< correspondence: for symmetric objects
};

/// Compares poses of one object. Const after construction and shareable.
class ObjectPoseComparer {
 public:
  /// `mesh` is in the object's own frame; all its vertices are compared. Throws Error for a mesh
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

/// First and second moments of a surface, by area; also defined for open meshes.
struct SurfaceMoments {
  double area_m2 = 0.0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();      ///< mean point, meters
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< about the center, m^2
};

/// Integrates exactly over the triangles. Throws Error for a mesh without area.
SurfaceMoments MeasureMoments(const TriangleMesh& mesh);

/// Largest distance between two vertices, meters.
double Diameter(const Eigen::Matrix3Xd& vertices);

}  // namespace holdfast
