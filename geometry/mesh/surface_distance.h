// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Distances between two surfaces a and b, meters. Each one-sided distance is exact from sample
/// points of one surface to the nearest point of the other. The samples are all vertices of faces
/// and points spread evenly by area. The maxima are therefore lower bounds of the Hausdorff
/// distances, short by less than the sample spacing. The means are over the evenly spread points.
struct SurfaceDistance {
  double hausdorff_forward_m = 0.0;   ///< from a to b
  double hausdorff_backward_m = 0.0;  ///< from b to a
  double mean_forward_m = 0.0;
  double mean_backward_m = 0.0;
};

/// Returns `count` points on a surface (3 x count), evenly spread by area. The i-th point lies in
/// the face where the cumulative area, in face order, reaches (i + 1/2) / count of the total, and
/// within the face at the i-th point of the R2 low-discrepancy sequence (Roberts 2018).
/// Deterministic. Throws Error for a mesh without area.
Eigen::Matrix3Xd SampleSurface(const TriangleMesh& mesh, int count);

/// Measures the distances with `samples` points on each surface in addition to the vertices. Throws
/// Error for a mesh without area.
SurfaceDistance MeasureSurfaceDistance(const TriangleMesh& a, const TriangleMesh& b,
                                       int samples = 100'000);

/// Whether two meshes represent the same surface at the same place and scale, at any resolution:
/// their distance is at most 1 % of the size on average and 5 % anywhere (a decimation to 300
/// vertices is 1 to 2 mm apart). Throws Error for a mesh without area.
bool SameSurface(const TriangleMesh& a, const TriangleMesh& b);

/// Returns sample points of a surface (3 x n, meters) for contact with soft bodies: spread over the
/// faces about `spacing_m` apart, and along sharp edges and at vertices, which area sampling misses
/// and which penetrate deepest. Redundant points closer than half the spacing are removed. Returns
/// not many more than `most` points in total. Deterministic. Throws Error for a mesh without area.
Eigen::Matrix3Xd ContactSamples(const TriangleMesh& mesh, double spacing_m, int most);

}  // namespace holdfast
