// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"

namespace holdfast {

/// A mesh with a defined inside, prepared for volume queries. Const and shareable.
struct Solid {
  /// Closes holes if `close_holes` (a hand is open at the wrist: CloseHoles). Throws Error as
  /// SignedDistance and CloseHoles do.
  explicit Solid(TriangleMesh surface, bool close_holes = false);

  /// Whether the mesh is closed, manifold and consistently oriented: the boundary of a volume.
  bool IsClosed() const { return distance.IsWatertight(); }

  TriangleMesh mesh;
  SignedDistance distance;
};

enum class VolumeStatus {
  kExact,
  kOpenSurface,       ///< a surface bounds no volume: the intersection volume is undefined
  kSelfIntersecting,  ///< a surface intersects itself in the overlap: inside is ambiguous there
  kNotResolved,       ///< the cut surface pieces do not close: no number is returned
  kNotBuilt,          ///< a build with HOLDFAST_GPL=OFF
};

/// Returns one plain clause per status, for reports.
std::string_view Describe(VolumeStatus status);

struct ExactVolume {
  VolumeStatus status = VolumeStatus::kExact;
  double volume_m3 = 0.0;  ///< only for kExact; zero otherwise

  bool Known() const { return status == VolumeStatus::kExact; }
};

/// Overlap region of two solids.
struct SolidOverlap {
  /// Faces of each solid that intersect the other's surface or have a corner inside it, ascending.
  std::vector<int> faces_a, faces_b;
  /// Bounding box of these faces; contains the intersection of the solids. Empty if they are
  /// disjoint.
  Eigen::AlignedBox3d box;
};

/// Finds the overlap of two closed solids. `distances_b` are the signed distances of b's vertices
/// from a, `inside_b` the vertices of a inside b. Positive distances may be lower bounds.
SolidOverlap FindOverlap(const Solid& a, const Solid& b, const Eigen::VectorXd& distances_b,
                         std::span<const int> inside_b);

/// Intersection volume of two polyhedra, exact to rounding. Both surfaces are cut along their
/// common curve with exact predicates (CGAL's corefinement). Each piece is then inside or outside
/// the other as a whole, and the pieces inside bound the intersection (divergence theorem).
/// Coincident faces are counted once. A self-intersection matters only if it is inside the other
/// body or on the curve. The closure of the pieces is verified (their vector areas sum to zero).
class ExactIntersection {
 public:
  /// Keeps a reference to `solid`.
  explicit ExactIntersection(const Solid& solid);

  ExactVolume With(const Solid& other) const;
  /// With(), for a known overlap of `solid` (a) and `other` (b).
  ExactVolume With(const Solid& other, const SolidOverlap& overlap) const;

 private:
  struct Crossings;

  bool CrossesItselfIn(const Solid& other, const SolidOverlap& overlap) const;

  const Solid* solid_;
  std::shared_ptr<Crossings> all_;  // of the whole solid, computed on first use
};

/// Intersection volume of one pair of meshes.
ExactVolume ExactIntersectionVolume(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace holdfast
