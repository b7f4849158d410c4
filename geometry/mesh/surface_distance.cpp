// SPDX-License-Identifier: MIT
#include "geometry/mesh/surface_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "geometry/error.h"
#include "geometry/mesh/half_edges.h"
#include "geometry/mesh/triangle_tree.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Largest and mean distance.
std::pair<double, double> Measure(const TriangleMesh& from, const TriangleTree& to, int samples) {
  double max = 0.0, mean = 0.0;
  int hint = -1;
  const auto distance = [&](const Eigen::Vector3d& point) {
    const TriangleTree::Hit hit = to.Closest(point, hint);
    hint = hit.face;
    return std::sqrt(hit.squared_distance);
  };
  const Eigen::Matrix3Xd points = SampleSurface(from, samples);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const double d = distance(points.col(i));
    max = std::max(max, d);
    mean += d;
  }
  if (samples > 0) mean /= samples;
  std::vector<bool> seen(from.NumVertices(), false);
  for (const int v : from.faces.reshaped()) {
    if (seen[v]) continue;
    seen[v] = true;
    max = std::max(max, distance(from.vertices.col(v)));
  }
  return {max, mean};
}

}  // namespace

Eigen::Matrix3Xd SampleSurface(const TriangleMesh& mesh, int count) {
  std::vector<double> area_up_to(mesh.NumFaces());
  double area = 0.0;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    area += 0.5 * FaceCross(mesh, f).norm();
    area_up_to[f] = area;
  }
  if (!(area > 0.0)) throw Error("mesh", "has no area to sample", "Give a surface");

  // 1 / g and 1 / g^2 for the plastic number g, the real root of g^3 = g + 1.
  constexpr double kStepU = 0.7548776662466927;
  constexpr double kStepV = 0.5698402909980532;
  Eigen::Matrix3Xd points(3, std::max(count, 0));
  Eigen::Index face = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const double target = (static_cast<double>(i) + 0.5) / static_cast<double>(count) * area;
    while (face + 1 < mesh.NumFaces() && area_up_to[face] <= target) ++face;
    double whole = 0.0;
    double u = std::modf(0.5 + kStepU * static_cast<double>(i + 1), &whole);
    double v = std::modf(0.5 + kStepV * static_cast<double>(i + 1), &whole);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, face));
    points.col(i) = a + u * (mesh.vertices.col(mesh.faces(1, face)) - a) +
                    v * (mesh.vertices.col(mesh.faces(2, face)) - a);
  }
  return points;
}

SurfaceDistance MeasureSurfaceDistance(const TriangleMesh& a, const TriangleMesh& b, int samples) {
  const auto [max_forward, mean_forward] = Measure(a, TriangleTree(b), samples);
  const auto [max_backward, mean_backward] = Measure(b, TriangleTree(a), samples);
  return {max_forward, max_backward, mean_forward, mean_backward};
}

bool SameSurface(const TriangleMesh& a, const TriangleMesh& b) {
  if (a.NumVertices() == b.NumVertices() && a.NumFaces() == b.NumFaces() &&
      a.vertices == b.vertices && a.faces == b.faces) {
    return true;  // the usual case: the object of the result itself
  }
  constexpr double kMean = 0.01, kAnywhere = 0.05;  // relative to the size
  constexpr int kSamples = 2000;
  const auto low = [](const TriangleMesh& mesh) { return mesh.vertices.rowwise().minCoeff(); };
  const auto high = [](const TriangleMesh& mesh) { return mesh.vertices.rowwise().maxCoeff(); };
  const double size = Extent(a).norm();
  if ((low(a) - low(b)).norm() > kAnywhere * size ||
      (high(a) - high(b)).norm() > kAnywhere * size) {
    return false;  // cheap test that rejects most different meshes
  }
  const SurfaceDistance apart = MeasureSurfaceDistance(a, b, kSamples);
  return std::max(apart.mean_forward_m, apart.mean_backward_m) <= kMean * size &&
         std::max(apart.hausdorff_forward_m, apart.hausdorff_backward_m) <= kAnywhere * size;
}

Eigen::Matrix3Xd ContactSamples(const TriangleMesh& mesh, double spacing_m, int most) {
  const double area = SurfaceArea(mesh);
  const double spacing = std::max(spacing_m, std::sqrt(area / most));
  // Keeps the first point in each grid cell.
  const double edge = 0.5 * spacing;
  std::set<std::array<long, 3>> taken;
  std::vector<Eigen::Vector3d> kept;
  const auto add = [&](const Eigen::Vector3d& point) {
    const Eigen::Array<long, 3, 1> cell = (point.array() / edge).floor().cast<long>();
    if (taken.insert({cell(0), cell(1), cell(2)}).second) kept.push_back(point);
  };
  constexpr double kSharp_rad = 20.0 * kDegree;
  for (const auto& [from, to] : HalfEdges(mesh).SharpEdges(kSharp_rad)) {
    const Eigen::Vector3d a = mesh.vertices.col(from), b = mesh.vertices.col(to);
    const int steps = std::max(1, static_cast<int>(std::ceil((b - a).norm() / spacing)));
    for (int k = 0; k <= steps; ++k) add(a + (static_cast<double>(k) / steps) * (b - a));
  }
  for (Eigen::Index i = 0; i < mesh.NumVertices(); ++i) add(mesh.vertices.col(i));
  const int spread = std::max(100, static_cast<int>(area / (spacing * spacing)));
  const Eigen::Matrix3Xd even = SampleSurface(mesh, spread);
  for (Eigen::Index i = 0; i < even.cols(); ++i) add(even.col(i));
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i) points.col(static_cast<Eigen::Index>(i)) = kept[i];
  return points;
}

}  // namespace holdfast
