// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"

namespace holdfast {

/// How contact is measured. Numbers can be compared only when this and the resolution of both
/// meshes are the same: reports carry it along.
struct ContactProtocol {
  double contact_threshold_mm = 5.0;  ///< a vertex is in contact when |signed distance| is below
  double voxel_mm = 2.0;              ///< edge of the cubes that the shared volume is counted in
  int threads = 1;                    ///< the results do not depend on it
  bool operator==(const ContactProtocol&) const = default;
};

/// Contact of one hand with one object in one frame. Depths and distances are those of the hand's
/// vertices to the object's surface: one way. Both ways is HandObjectFrame
/// (geometry/score/hand_object_score.h), what clips are measured by.
struct ContactMetrics {
  double max_penetration_mm = 0.0;   ///< depth of the deepest vertex inside the object; 0 if none
  double mean_penetration_mm = 0.0;  ///< mean depth of the vertices inside; 0 if none
  double penetrating_ratio = 0.0;    ///< share of the vertices that are inside
  double contact_ratio = 0.0;        ///< share of the vertices in contact
  bool in_contact = false;           ///< whether any vertex is in contact or inside
  double min_distance_mm = 0.0;      ///< smallest signed distance, negative inside
  double intersection_volume_cm3 = 0.0;  ///< shared by the solid hand and object; 0 if not measured
  bool operator==(const ContactMetrics&) const = default;
};

/// Metrics of a hand's vertices by their signed distances (meters) from the object, without the
/// volume. Throws Error for no vertices.
ContactMetrics ContactFromDistances(const Eigen::VectorXd& distances_m,
                                    const ContactProtocol& protocol = {});

/// Metrics of hand vertices (3 x n, meters, in the object's coordinate frame), without the volume.
/// Throws Error for no vertices.
ContactMetrics MeasureContact(const Eigen::Matrix3Xd& hand_vertices_in_object,
                              const SignedDistance& object, const ContactProtocol& protocol = {});

/// The same for a hand's mesh, with the volume. A hand cut from a body is open at the wrist: it is
/// closed first (CloseHoles), which adds to the volume only.
ContactMetrics MeasureContact(const TriangleMesh& hand_in_object, const SignedDistance& object,
                              const ContactProtocol& protocol = {});

/// Closes every boundary loop by a fan around a new vertex at the mean of the loop's, oriented like
/// the faces beside it. New vertices come behind the given ones; where the boundary touches itself
/// in a vertex that is doubled. Throws Error for edges of more than two faces or faces that
/// disagree.
TriangleMesh CloseHoles(const TriangleMesh& mesh);

/// What CloseHoles does to a mesh, for other places of its vertices too: a hand from frame to
/// frame.
class HoleFill {
 public:
  /// Throws Error as CloseHoles.
  explicit HoleFill(const TriangleMesh& mesh);

  /// Of the closed mesh; those of the given one come first.
  const Eigen::Matrix3Xi& Faces() const { return faces_; }
  /// The vertices, and behind them those that were added.
  Eigen::Matrix3Xd Vertices(const Eigen::Matrix3Xd& vertices) const;

 private:
  Eigen::Matrix3Xi faces_;
  std::vector<std::vector<int>> added_;  // each the mean of these
};

/// Volume (m^3) of what two solids share: cubes of edge `voxel_m`, on a grid fixed to the origin of
/// the coordinate frame, whose centers are inside both. Without bias; off by about the area of the
/// shared boundary times half a voxel divided by the root of the number of cubes there.
double IntersectionVolume(const SignedDistance& a, const SignedDistance& b, double voxel_m,
                          int threads = 1);

/// The same where nothing is inside both outside `box`: the cubes of it alone are looked at.
double IntersectionVolume(const SignedDistance& a, const SignedDistance& b, double voxel_m,
                          const Eigen::AlignedBox3d& box, int threads = 1);

}  // namespace holdfast
