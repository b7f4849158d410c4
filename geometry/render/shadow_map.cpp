// SPDX-License-Identifier: MIT
#include "geometry/render/shadow_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "geometry/render/triangle_scan.h"

namespace holdfast {
namespace {

constexpr double kMostCells = 1024.0;
constexpr float kStrength = 0.7f;  // the light is wide: some of it reaches everywhere

}  // namespace

ShadowMap::ShadowMap(std::span<const TriangleMesh* const> meshes, const Eigen::Vector3d& to_light,
                     double finest_m) {
  const Eigen::Vector3d across = to_light.unitOrthogonal();
  light_from_world_ << across.transpose(), to_light.cross(across).transpose(), to_light.transpose();

  Eigen::AlignedBox2d box;
  std::vector<Eigen::Matrix3Xd> in_light;
  for (const TriangleMesh* mesh : meshes) {
    in_light.emplace_back(light_from_world_ * mesh->vertices);
    for (Eigen::Index v = 0; v < mesh->NumVertices(); ++v) {
      const auto p = in_light.back().col(v);
      if (p.allFinite()) box.extend(Eigen::Vector2d(p.head<2>()));
    }
  }
  if (box.isEmpty()) return;
  const double side = std::max(1.02 * box.sizes().maxCoeff(), 1e-9);
  cell_m_ = std::max(side / kMostCells, std::min(finest_m, side));
  size_ = static_cast<int>(std::ceil(side / cell_m_));
  corner_ = box.center() - Eigen::Vector2d::Constant(0.5 * cell_m_ * size_);
  nearest_.assign(static_cast<std::size_t>(size_) * size_, -std::numeric_limits<float>::infinity());

  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const TriangleMesh& mesh = *meshes[m];
    for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
      std::array<Eigen::Vector2d, 3> cell;
      Eigen::Vector3d height;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d p = in_light[m].col(mesh.faces(k, f));
        cell[k] = (p.head<2>() - corner_) / cell_m_;
        height[k] = p.z();
      }
      if (!height.allFinite() || !cell[0].allFinite() || !cell[1].allFinite() ||
          !cell[2].allFinite()) {
        continue;
      }
      // The height as a linear function of the cell; between the corners' where that is steep.
      Eigen::Matrix2d edges;
      edges << (cell[1] - cell[0]).transpose(), (cell[2] - cell[0]).transpose();
      const double area = edges.determinant();
      if (area == 0.0) continue;
      const Eigen::Vector2d slope =
          Eigen::Vector2d(
              edges(1, 1) * (height[1] - height[0]) - edges(0, 1) * (height[2] - height[0]),
              edges(0, 0) * (height[2] - height[0]) - edges(1, 0) * (height[1] - height[0])) /
          area;
      const double low = height.minCoeff();
      const double high = height.maxCoeff();
      ScanTriangle(cell, size_, size_, [&](int x, int y) {
        const Eigen::Vector2d offset = Eigen::Vector2d(x + 0.5, y + 0.5) - cell[0];
        const auto z = static_cast<float>(std::clamp(height[0] + slope.dot(offset), low, high));
        float& nearest = nearest_[static_cast<std::size_t>(y) * size_ + x];
        nearest = std::max(nearest, z);
      });
    }
  }
}

float ShadowMap::Tap(double x, double y, float height) const {
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  if (column < 1 || row < 1 || column + 2 >= size_ || row + 2 >= size_) return 1.0f;
  const auto u = static_cast<float>(x - column);
  const auto v = static_cast<float>(y - row);
  const std::array<float, 4> weight_x = {1.0f - u, 1.0f, 1.0f, u};
  const std::array<float, 4> weight_y = {1.0f - v, 1.0f, 1.0f, v};
  float lit = 0.0f;
  for (int j = 0; j < 4; ++j) {
    const float* const cells =
        nearest_.data() + static_cast<std::size_t>(row - 1 + j) * size_ + (column - 1);
    float line = 0.0f;
    for (int i = 0; i < 4; ++i) line += cells[i] <= height ? weight_x[i] : 0.0f;
    lit += weight_y[j] * line;
  }
  return lit / 9.0f;
}

float ShadowMap::Light(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
  if (nearest_.empty()) return 1.0f;
  const double cosine = normal.dot(light_from_world_.row(2));
  if (cosine <= 0.0) return 1.0f;  // turned away: no light to lose
  // Lifted off the surface by the size of the filter, lest the surface shade itself.
  const Eigen::Vector3d p = light_from_world_ * (point + 4.0 * cell_m_ * (1.2 - cosine) * normal);
  const auto height = static_cast<float>(p.z() + 1.5 * cell_m_);
  const Eigen::Vector2d at = (p.head<2>() - corner_) / cell_m_ - Eigen::Vector2d::Constant(0.5);
  // Four taps on a slanted square: a penumbra of about eight cells.
  float lit = 0.0f;
  for (const auto& [x, y] : {std::pair(2.2, 0.9), {-0.9, 2.2}, {-2.2, -0.9}, {0.9, -2.2}}) {
    lit += 0.25f * Tap(at.x() + x, at.y() + y, height);
  }
  // At grazing light facets would show: there the smooth shading darkens enough by itself.
  const float trust = std::clamp(static_cast<float>(cosine) / 0.25f, 0.0f, 1.0f);
  return 1.0f - kStrength * trust * (1.0f - lit);
}

}  // namespace holdfast
