// SPDX-License-Identifier: MIT
#include "geometry/render/ground_shadow.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "geometry/render/triangle_scan.h"

namespace holdfast {
namespace {

constexpr float kCastDarkness = 0.42f;
constexpr float kContactDarkness = 0.40f;

// One pass of a box filter of 2 radius + 1 cells along lines `stride` apart; outside is zero.
void BoxBlurLines(std::vector<float>& map, int size, int radius, int step, int stride) {
  std::vector<float> line(static_cast<std::size_t>(size));
  const float weight = 1.0f / static_cast<float>(2 * radius + 1);
  for (int l = 0; l < size; ++l) {
    float* const cell = map.data() + static_cast<std::ptrdiff_t>(l) * stride;
    for (int k = 0; k < size; ++k) line[k] = cell[static_cast<std::ptrdiff_t>(k) * step];
    float sum = 0.0f;
    for (int k = 0; k < std::min(radius, size); ++k) sum += line[k];
    for (int k = 0; k < size; ++k) {
      if (k + radius < size) sum += line[k + radius];
      cell[static_cast<std::ptrdiff_t>(k) * step] = std::max(0.0f, sum * weight);
      if (k - radius >= 0) sum -= line[k - radius];
    }
  }
}

// Three box filters are close to a Gaussian.
void Blur(std::vector<float>& map, int size, int radius) {
  for (int pass = 0; pass < 3; ++pass) {
    BoxBlurLines(map, size, radius, 1, size);
    BoxBlurLines(map, size, radius, size, 1);
  }
}

}  // namespace

GroundShadow::GroundShadow(std::span<const TriangleMesh* const> meshes, double ground_height_m,
                           const Eigen::Vector3d& to_light) {
  const Eigen::Vector2d slope = to_light.head<2>() / std::max(to_light.z(), 0.1);
  const auto cast = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector2d(p.head<2>() - (p.z() - ground_height_m) * slope);
  };
  Eigen::AlignedBox3d scene;
  Eigen::AlignedBox2d covered;
  for (const TriangleMesh* mesh : meshes) {
    for (Eigen::Index v = 0; v < mesh->NumVertices(); ++v) {
      const Eigen::Vector3d p = mesh->vertices.col(v);
      if (!p.allFinite() || p.z() < ground_height_m) continue;
      scene.extend(p);
      covered.extend(cast(p));
      covered.extend(Eigen::Vector2d(p.head<2>()));
    }
  }
  if (scene.isEmpty()) return;
  const double height = scene.max().z() - ground_height_m;
  const double softness = 0.02 * std::max(height, scene.sizes().maxCoeff());
  const double reach = 0.06 * std::max(height, 1e-3);  // how far up contact dimming is felt
  const double margin = 8.0 * softness + 1e-6;
  const double side = covered.sizes().maxCoeff() + 2.0 * margin;
  left_ = covered.center().x() - 0.5 * side;
  bottom_ = covered.center().y() - 0.5 * side;
  cells_per_metre_ = kSize / side;

  std::vector<float> cast_shadow(kSize * kSize, 0.0f);
  std::vector<float> contact(kSize * kSize, 0.0f);
  const Eigen::Vector2d origin(left_, bottom_);
  for (const TriangleMesh* mesh : meshes) {
    for (Eigen::Index f = 0; f < mesh->NumFaces(); ++f) {
      std::array<Eigen::Vector2d, 3> along_light, below;
      double lowest = INFINITY;
      bool usable = true;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d p = mesh->vertices.col(mesh->faces(k, f));
        usable = usable && p.allFinite() && p.z() >= ground_height_m;
        along_light[k] = (cast(p) - origin) * cells_per_metre_;
        below[k] = (p.head<2>() - origin) * cells_per_metre_;
        lowest = std::min(lowest, p.z() - ground_height_m);
      }
      if (!usable) continue;
      ScanTriangle(along_light, kSize, kSize,
                   [&](int x, int y) { cast_shadow[y * kSize + x] = 1.0f; });
      const auto near = static_cast<float>(std::exp(-lowest / reach));
      if (near < 0.02f) continue;
      ScanTriangle(below, kSize, kSize, [&](int x, int y) {
        contact[y * kSize + x] = std::max(contact[y * kSize + x], near);
      });
    }
  }
  const int radius = std::max(1, static_cast<int>(std::lround(softness * cells_per_metre_)));
  Blur(cast_shadow, kSize, radius);
  Blur(contact, kSize, std::max(1, radius / 2));
  light_.resize(kSize * kSize);
  for (int i = 0; i < kSize * kSize; ++i) {
    light_[i] = (1.0f - kCastDarkness * cast_shadow[i]) * (1.0f - kContactDarkness * contact[i]);
  }
}

float GroundShadow::Light(double x, double y) const {
  if (light_.empty()) return 1.0f;
  const double column = (x - left_) * cells_per_metre_ - 0.5;
  const double row = (y - bottom_) * cells_per_metre_ - 0.5;
  if (!(column >= 0.0 && row >= 0.0 && column < kSize - 1 && row < kSize - 1)) return 1.0f;
  const int i = static_cast<int>(column);
  const int j = static_cast<int>(row);
  const auto u = static_cast<float>(column - i);
  const auto v = static_cast<float>(row - j);
  const float* const cell = light_.data() + j * kSize + i;
  return (1.0f - v) * ((1.0f - u) * cell[0] + u * cell[1]) +
         v * ((1.0f - u) * cell[kSize] + u * cell[kSize + 1]);
}

}  // namespace holdfast
