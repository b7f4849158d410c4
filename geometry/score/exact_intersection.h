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

/// A mesh as a body with an inside, prepared for volume queries. Const and shareable.
struct Solid {
  /// Closes holes when `close_holes` (a hand is open at the wrist: CloseHoles). Throws Error as
  /// SignedDistance and CloseHoles do.
  explicit Solid(TriangleMesh surface, bool close_holes = false);

  /// Closed, manifold and consistently oriented: the boundary of a volume.
  bool IsClosed() const { return distance.SignMethod() == SignedDistance::Sign::kPseudonormal; }

  TriangleMesh mesh;
  SignedDistance distance;
};

enum class VolumeStatus {
  kExact,
  kOpenSurface,       ///< one of the surfaces bounds no volume: the shared volume is undefined
  kSelfIntersecting,  ///< a surface crosses itself where it counts: inside is ambiguous there
  kNotResolved,       ///< the pieces of the surfaces found do not close: no number is better
};

/// One plain clause per status, for reports.
std::string_view Describe(VolumeStatus status);

struct ExactVolume {
  VolumeStatus status = VolumeStatus::kExact;
  double volume_m3 = 0.0;  ///< only with kExact; zero otherwise

  bool Known() const { return status == VolumeStatus::kExact; }
};

/// Places (3 x n) where a surface crosses itself: one point on the segment common to each pair of
/// faces that meet other than in a shared corner or edge. Only `faces` are looked at.
Eigen::Matrix3Xd SelfCrossings(const TriangleMesh& mesh, std::span<const int> faces);

/// Where two solids reach into each other.
struct SolidOverlap {
  /// Faces of either that meet the other's surface or have a corner inside it, ascending.
  std::vector<int> faces_a, faces_b;
  /// Of these faces: what is inside both solids is in it. Empty: nothing is.
  Eigen::AlignedBox3d box;
};

/// Both must be closed. `distances_b` are the signed distances of b's vertices from a, `inside_b`
/// the vertices of a inside b; distances may be too small where they are positive.
SolidOverlap FindOverlap(const Solid& a, const Solid& b, const Eigen::VectorXd& distances_b,
                         std::span<const int> inside_b);

/// Volume of what two polyhedra share, exact to rounding. Both surfaces are cut along their common
/// curve with exact predicates (CGAL's corefinement), each piece is inside or outside the other as
/// a whole, and the pieces inside bound the shared volume (divergence theorem). Faces that lie on
/// each other are counted once. A surface that crosses itself matters only where that crossing is
/// inside the other body or on the curve. That the pieces close is checked (their vector areas sum
/// to zero).
class ExactIntersection {
 public:
  /// Keeps a reference to `solid`.
  explicit ExactIntersection(const Solid& solid);

  ExactVolume With(const Solid& other) const;
  /// The same by where `solid` (a) and `other` (b) are known to overlap.
  ExactVolume With(const Solid& other, const SolidOverlap& overlap) const;

 private:
  struct Crossings;

  bool CrossesItselfIn(const Solid& other, const SolidOverlap& overlap) const;

  const Solid* solid_;
  std::shared_ptr<Crossings> all_;  // of the whole solid, looked for when first asked
};

/// The same for one pair of meshes.
ExactVolume ExactIntersectionVolume(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace holdfast
