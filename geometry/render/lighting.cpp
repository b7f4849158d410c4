// SPDX-License-Identifier: MIT
#include "geometry/render/lighting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "geometry/render/visibility.h"

namespace holdfast {
namespace {

float LinearChannel(float v) {
  v = std::clamp(v, 0.0f, 1.0f);
  return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

// Smallest linear value that rounds to each byte: encoding is an exact search, without pow.
const std::array<float, 256>& ByteThresholds() {
  static const std::array<float, 256> thresholds = [] {
    std::array<float, 256> t{};
    for (int b = 1; b < 256; ++b) t[b] = LinearChannel((static_cast<float>(b) - 0.5f) / 255.0f);
    return t;
  }();
  return thresholds;
}

// Diffuse light of a wide source: extends slightly past the terminator.
float Wrapped(float cosine, float wrap) { return std::max(0.0f, (cosine + wrap) / (1.0f + wrap)); }

}  // namespace

Eigen::Vector3f LinearFromSrgb(const Eigen::Vector3d& srgb) {
  return {LinearChannel(static_cast<float>(srgb.x())), LinearChannel(static_cast<float>(srgb.y())),
          LinearChannel(static_cast<float>(srgb.z()))};
}

std::uint8_t SrgbByteFromLinear(float linear) {
  const auto& t = ByteThresholds();
  return static_cast<std::uint8_t>(std::upper_bound(t.begin() + 1, t.end(), linear) - t.begin() -
                                   1);
}

Lighting::Lighting(const View& view) {
  // Horizontal right and forward of the camera; when looking straight down, the picture's up.
  const Eigen::Vector3d right = view.CameraFromWorld().row(0);
  Eigen::Vector3d forward = Eigen::Vector3d::UnitZ().cross(right);
  forward = forward.norm() > 1e-6 ? Eigen::Vector3d(forward.normalized())
                                  : Eigen::Vector3d(Eigen::Vector3d::UnitY());
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  to_key = (-0.75 * right - 0.45 * forward + 0.90 * up).normalized().cast<float>();
  to_fill = (0.85 * right - 0.5 * forward + 0.3 * up).normalized().cast<float>();
  to_rim = (0.25 * right + 0.85 * forward + 0.5 * up).normalized().cast<float>();
}

Eigen::Vector3f Lighting::Shade(const Eigen::Vector3f& albedo, const Eigen::Vector3f& normal,
                                const Eigen::Vector3f& to_eye, float key) const {
  static const Eigen::Vector3f kKey(1.05f, 0.99f, 0.90f);
  static const Eigen::Vector3f kFill(0.13f, 0.155f, 0.20f);
  static const Eigen::Vector3f kSky(0.19f, 0.21f, 0.24f);
  static const Eigen::Vector3f kEarth(0.08f, 0.073f, 0.068f);

  const float sky = 0.5f + 0.5f * normal.z();
  const Eigen::Vector3f diffuse = kKey * (key * Wrapped(normal.dot(to_key), 0.10f)) +
                                  kFill * Wrapped(normal.dot(to_fill), 0.4f) + kSky * sky +
                                  kEarth * (1.0f - sky);
  // Blinn's highlight of the key light with exponent 32, and rim light at grazing angles.
  float gloss = std::max(0.0f, normal.dot((to_key + to_eye).normalized()));
  for (int k = 0; k < 5; ++k) gloss *= gloss;
  const float facing = std::clamp(1.0f - normal.dot(to_eye), 0.0f, 1.0f);
  const float rim = facing * facing * facing * std::max(0.0f, normal.dot(to_rim));
  return albedo.cwiseProduct(diffuse) +
         Eigen::Vector3f::Constant(0.07f * key * gloss + 0.25f * rim);
}

namespace {

constexpr double kMaxCells = 1024.0;
constexpr float kStrength = 0.7f;  // below 1: some of a wide light reaches everywhere

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
  cell_m_ = std::max(side / kMaxCells, std::min(finest_m, side));
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
      // Height as a linear function of the cell, clamped to the corners' range if steep.
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
  // Offset from the surface by the filter size to avoid self-shadowing.
  const Eigen::Vector3d p = light_from_world_ * (point + 4.0 * cell_m_ * (1.2 - cosine) * normal);
  const auto height = static_cast<float>(p.z() + 1.5 * cell_m_);
  const Eigen::Vector2d at = (p.head<2>() - corner_) / cell_m_ - Eigen::Vector2d::Constant(0.5);
  // Four taps on a rotated square: a penumbra of about eight cells.
  float lit = 0.0f;
  for (const auto& [x, y] : {std::pair(2.2, 0.9), {-0.9, 2.2}, {-2.2, -0.9}, {0.9, -2.2}}) {
    lit += 0.25f * Tap(at.x() + x, at.y() + y, height);
  }
  // At grazing angles facets would show; the smooth shading is dark enough there.
  const float trust = std::clamp(static_cast<float>(cosine) / 0.25f, 0.0f, 1.0f);
  return 1.0f - kStrength * trust * (1.0f - lit);
}

namespace {

constexpr float kCastDarkness = 0.42f;
constexpr float kContactDarkness = 0.40f;

// One box filter pass of 2 radius + 1 cells along lines `stride` apart; zero outside.
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

// Three box filters approximate a Gaussian.
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
  const double reach = 0.06 * std::max(height, 1e-3);  // height affected by contact dimming
  const double margin = 8.0 * softness + 1e-6;
  const double side = covered.sizes().maxCoeff() + 2.0 * margin;
  left_ = covered.center().x() - 0.5 * side;
  bottom_ = covered.center().y() - 0.5 * side;
  cells_per_meter_ = kSize / side;

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
        along_light[k] = (cast(p) - origin) * cells_per_meter_;
        below[k] = (p.head<2>() - origin) * cells_per_meter_;
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
  const int radius = std::max(1, static_cast<int>(std::lround(softness * cells_per_meter_)));
  Blur(cast_shadow, kSize, radius);
  Blur(contact, kSize, std::max(1, radius / 2));
  light_.resize(kSize * kSize);
  for (int i = 0; i < kSize * kSize; ++i) {
    light_[i] = (1.0f - kCastDarkness * cast_shadow[i]) * (1.0f - kContactDarkness * contact[i]);
  }
}

float GroundShadow::Light(double x, double y) const {
  if (light_.empty()) return 1.0f;
  const double column = (x - left_) * cells_per_meter_ - 0.5;
  const double row = (y - bottom_) * cells_per_meter_ - 0.5;
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
