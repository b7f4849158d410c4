// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"
#include "geometry/mesh/signed_distance.h"

namespace holdfast {

/// Parameters of contact measurement. Metrics are comparable only for equal parameters and equal
/// mesh resolutions, so reports include the protocol.
struct ContactProtocol {
  double contact_threshold_mm = 5.0;  ///< a vertex is in contact if |signed distance| is below
  double voxel_mm = 2.0;              ///< edge of the cubes for the intersection volume
  int threads = 1;                    ///< does not change the results
  bool operator==(const ContactProtocol&) const = default;
};

/// Contact of one hand with one object in one frame. Depths and distances are one-sided: from the
/// hand's vertices to the object's surface. Clips are measured by HandObjectFrame
/// (geometry/score/hand_object_score.h), which is two-sided.
struct ContactMetrics {
  double max_penetration_mm = 0.0;   ///< depth of the deepest vertex inside the object; 0 if none
  double mean_penetration_mm = 0.0;  ///< mean depth of the vertices inside; 0 if none
  double penetrating_ratio = 0.0;    ///< fraction of the vertices inside
  double contact_ratio = 0.0;        ///< fraction of the vertices in contact
  bool in_contact = false;           ///< whether any vertex is in contact or inside
  double min_distance_mm = 0.0;      ///< smallest signed distance, negative inside
  double intersection_volume_cm3 = 0.0;  ///< of hand and object; 0 if not measured
  bool operator==(const ContactMetrics&) const = default;
};

/// Computes the metrics of a hand from its vertices' signed distances (meters) to the object,
/// without the volume. Throws Error for no vertices.
ContactMetrics ContactFromDistances(const Eigen::VectorXd& distances_m,
                                    const ContactProtocol& protocol = {});

/// Computes the metrics of a hand mesh, including the volume. A hand cut from a body is open at the
/// wrist; it is closed first (CloseHoles), which only affects the volume.
ContactMetrics MeasureContact(const TriangleMesh& hand_in_object, const SignedDistance& object,
                              const ContactProtocol& protocol = {});

/// Closes every boundary loop by a fan around a new vertex at the mean of the loop's vertices,
/// oriented like the adjacent faces. New vertices are appended. Vertices where the boundary touches
/// itself are duplicated. Throws Error for edges of more than two faces or inconsistent
/// orientation.
TriangleMesh CloseHoles(const TriangleMesh& mesh);

/// The result of CloseHoles, reusable for other vertex positions of the same mesh, such as a hand
/// from frame to frame.
class HoleFill {
 public:
  /// Throws Error as CloseHoles.
  explicit HoleFill(const TriangleMesh& mesh);

  /// Faces of the closed mesh; those of the input come first.
  const Eigen::Matrix3Xi& Faces() const { return faces_; }
  /// Returns the vertices followed by the added vertices.
  Eigen::Matrix3Xd Vertices(const Eigen::Matrix3Xd& vertices) const;

 private:
  Eigen::Matrix3Xi faces_;
  std::vector<std::vector<int>> added_;  // each added vertex is the mean of these
};

/// Intersection volume (m^3) of two solids: the volume of the cubes of edge `voxel_m`, on a grid
/// fixed to the origin, whose centers are inside both. Unbiased; the error is about the area of the
/// common boundary times half a voxel divided by the root of the number of cubes there.
double IntersectionVolume(const SignedDistance& a, const SignedDistance& b, double voxel_m,
                          int threads = 1);

}  // namespace holdfast
