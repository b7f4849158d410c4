// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/triangle_tree.h"

namespace holdfast {

/// Antipodal pair: two places on an object that face away from each other, where a thumb and
/// fingers can press against each other without slipping.
struct Opposition {
  Eigen::Vector3d center;  ///< midpoint, object frame
  Eigen::Vector3d axis;    ///< unit, between the places; either end may be the thumb's
  double width;            ///< distance between the places, meters
  double quality;          ///< in (0, 1]: opposed normals, convenient width, near the centroid
};

struct OppositionOptions {
  int samples = 600;                ///< surface samples tried
  int count = 40;                   ///< distinct pairs kept, the best of each neighborhood
  double max_width_m = 0.105;       ///< span of a hand
  double min_normal_cosine = 0.80;  ///< of either normal with the axis: within the friction cone
  std::uint64_t seed = 0;
  /// Whether a surface point may be one of the two places; empty: any.
  std::function<bool(const Eigen::Vector3d&)> allowed = {};
  /// Factor on the quality, in (0, 1]; empty: 1.
  std::function<double(const Opposition&)> weight = {};
};

/// Finds antipodal pairs. A ray is cast inward from each of a low-discrepancy set of surface
/// points; each place where it exits facing away becomes a partner. This covers thin walls as well
/// as the full width of a hollow object. Sorted by quality; deterministic for a seed.
std::vector<Opposition> FindOppositions(const TriangleMesh& object, const DistanceGrid& distance,
                                        const Eigen::Vector3d& centroid,
                                        const OppositionOptions& options);

/// Ray straight into an object, from its surface to the exit point.
struct InwardRay {
  Eigen::Vector3d start, inward;  ///< on the surface; unit
  double length;
};

/// Casts an InwardRay from the surface point nearest to `place`; nothing if the object is thicker
/// than `most_m` there. `tree` is of the same mesh.
std::optional<InwardRay> MeasureThickness(const TriangleMesh& object, const TriangleTree& tree,
                                          const Eigen::Vector3d& place, double most_m);

/// Whether any part of an object is thin enough for a hand (or two) to close on: some inward ray,
/// of many over its surface, exits within `span_m`. If not, FindOppositions finds nothing either;
/// this check needs no distance grid.
bool IsWithinSpan(const TriangleMesh& object, double span_m);

/// Centroid of the solid (of the surface if it has no volume).
Eigen::Vector3d SolidCentroid(const TriangleMesh& mesh);

/// Points (3 x n) spread evenly by area over a surface, in a low-discrepancy order.
Eigen::Matrix3Xd SampleSurface(const TriangleMesh& mesh, int count, std::uint64_t seed);

}  // namespace holdfast
