// SPDX-License-Identifier: MIT
#include "geometry/mesh/contact_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "geometry/mesh/surface_distance.h"

namespace holdfast {
namespace {

constexpr double kSharpCosine = 0.94;  // faces that differ by more than 20 degrees

// Keeps the first point of every cube.
class Thinning {
 public:
  explicit Thinning(double edge) : edge_(edge) {}
  void Add(const Eigen::Vector3d& point) {
    const Eigen::Array3d cell = (point.array() / edge_).floor();
    if (taken_
            .insert({static_cast<long>(cell(0)), static_cast<long>(cell(1)),
                     static_cast<long>(cell(2))})
            .second) {
      points_.push_back(point);
    }
  }
  const std::vector<Eigen::Vector3d>& Points() const { return points_; }

 private:
  double edge_;
  std::set<std::array<long, 3>> taken_;
  std::vector<Eigen::Vector3d> points_;
};

// Ends of every edge whose two faces meet at an angle, or that has one face only.
std::vector<std::pair<int, int>> SharpEdges(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, std::vector<Eigen::Vector3d>> normals;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const Eigen::Vector3i ids = mesh.faces.col(f);
    const Eigen::Vector3d n = FaceCross(mesh, f);
    if (n.squaredNorm() == 0.0) continue;
    for (int k = 0; k < 3; ++k) {
      normals[std::minmax(ids(k), ids((k + 1) % 3))].push_back(n.normalized());
    }
  }
  std::vector<std::pair<int, int>> sharp;
  for (const auto& [edge, sides] : normals) {
    if (sides.size() != 2 || sides[0].dot(sides[1]) < kSharpCosine) sharp.push_back(edge);
  }
  return sharp;
}

}  // namespace

Eigen::Matrix3Xd ContactSamples(const TriangleMesh& mesh, double spacing_m, int most) {
  const double area = SurfaceArea(mesh);
  const double spacing = std::max(spacing_m, std::sqrt(area / most));
  Thinning thinning(0.5 * spacing);
  for (const auto& [from, to] : SharpEdges(mesh)) {
    const Eigen::Vector3d a = mesh.vertices.col(from), b = mesh.vertices.col(to);
    const int steps = std::max(1, static_cast<int>(std::ceil((b - a).norm() / spacing)));
    for (int k = 0; k <= steps; ++k) thinning.Add(a + (static_cast<double>(k) / steps) * (b - a));
  }
  for (Eigen::Index i = 0; i < mesh.NumVertices(); ++i) thinning.Add(mesh.vertices.col(i));
  const int spread = std::max(100, static_cast<int>(area / (spacing * spacing)));
  const Eigen::Matrix3Xd even = SampleSurface(mesh, spread);
  for (Eigen::Index i = 0; i < even.cols(); ++i) thinning.Add(even.col(i));
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(thinning.Points().size()));
  for (std::size_t i = 0; i < thinning.Points().size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = thinning.Points()[i];
  }
  return points;
}

}  // namespace holdfast
