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

/// Two places on an object that face away from each other: where a thumb and fingers can press
/// against each other without sliding off.
struct Opposition {
  Eigen::Vector3d center;  ///< halfway, object frame
  Eigen::Vector3d axis;    ///< unit, from one place to the other; either end may be the thumb's
  double width;            ///< how far apart, meters
  double quality;          ///< in (0, 1]: opposed normals, a width a hand likes, near the centroid
};

struct OppositionOptions {
  int samples = 600;                ///< places tried on the surface
  int count = 40;                   ///< different oppositions kept, the best of their neighborhood
  double max_width_m = 0.105;       ///< what a hand spans
  double min_normal_cosine = 0.80;  ///< of either normal with the axis: within the friction cone
  std::uint64_t seed = 0;
  /// Whether a place of the surface may be one of the two; empty: any may.
  std::function<bool(const Eigen::Vector3d&)> allowed = {};
  /// Multiplies the quality, in (0, 1]; empty: 1.
  std::function<double(const Opposition&)> weight = {};
};

/// Rays from low-discrepancy points of the surface go straight in; every place where they come out
/// again facing away is a partner: thin walls, and what a hollow object spans as a whole.
/// Sorted by quality, deterministic for a seed.
std::vector<Opposition> FindOppositions(const TriangleMesh& object, const DistanceGrid& distance,
                                        const Eigen::Vector3d& centroid,
                                        const OppositionOptions& options);

/// The way straight into an object, from its surface to where it is left again.
struct InwardRay {
  Eigen::Vector3d start, inward;  ///< on the surface; unit
  double length;
};

/// From the place of the surface nearest to `place`; nothing where it is more than `most_m` thick.
/// `tree` is of the same mesh.
std::optional<InwardRay> MeasureThickness(const TriangleMesh& object, const TriangleTree& tree,
                                          const Eigen::Vector3d& place, double most_m);

/// Whether anything of an object is so thin that a hand (or two) could close on it: straight in
/// from some of many places of its surface, it is left again within `span_m`. Where it is not,
/// FindOppositions finds nothing either, and this takes no distance grid to state it.
bool IsWithinSpan(const TriangleMesh& object, double span_m);

/// Centroid of the solid (of the surface when it has no volume).
Eigen::Vector3d SolidCentroid(const TriangleMesh& mesh);

/// Points spread evenly by area over a surface (3 x n), in a low-discrepancy order.
Eigen::Matrix3Xd SampleSurface(const TriangleMesh& mesh, int count, std::uint64_t seed);

}  // namespace holdfast
