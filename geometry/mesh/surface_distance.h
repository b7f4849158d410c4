// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// How far apart two surfaces a and b are, meters. Each one-sided distance is from points on the
/// one surface to the nearest point of the other, which is exact; the points are every vertex of a
/// face, and points spread evenly by area. The maxima are therefore lower bounds of the Hausdorff
/// distances, short of them by less than the points' spacing; the means are over the evenly spread
/// points.
struct SurfaceDistance {
  double hausdorff_forward_m = 0.0;   ///< from a to b
  double hausdorff_backward_m = 0.0;  ///< from b to a
  double mean_forward_m = 0.0;
  double mean_backward_m = 0.0;
};

/// `count` points on a surface (3 x count), evenly spread by area: the i-th point lies where (i +
/// 1/2) / count of the area has passed, going through the faces in order, and within its face at
/// the i-th point of the R2 low-discrepancy sequence (Roberts 2018). The same mesh gives the same
/// points. Throws Error for a mesh without area.
Eigen::Matrix3Xd SampleSurface(const TriangleMesh& mesh, int count);

/// Distances with `samples` points on each surface besides the vertices.
/// Throws Error for a mesh without area.
SurfaceDistance MeasureSurfaceDistance(const TriangleMesh& a, const TriangleMesh& b,
                                       int samples = 100'000);

/// Whether two meshes show one thing in one place and size, however finely: apart by at most 1 % of
/// its size in the mean and 5 % anywhere (a decimation to 300 vertices is apart by 1 to 2 mm).
/// Throws Error for a mesh without area.
bool SameSurface(const TriangleMesh& a, const TriangleMesh& b);

/// Points of a surface that something soft would meet first (3 x n, meters): spread over the faces
/// about `spacing_m` apart, and along sharp edges and at vertices, which points spread by area miss
/// and which cut deepest. No two are nearer than half the spacing where one of them would do; not
/// many more than `most` in all. The same mesh gives the same points. Throws Error for a mesh
/// without area.
Eigen::Matrix3Xd ContactSamples(const TriangleMesh& mesh, double spacing_m, int most);

}  // namespace holdfast
