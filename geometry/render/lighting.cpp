// SPDX-License-Identifier: MIT
#include "geometry/render/lighting.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

namespace holdfast {
namespace {

float LinearChannel(float v) {
  v = std::clamp(v, 0.0f, 1.0f);
  return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

// Smallest linear value that rounds to each byte: encoding is a search, exact and without pow.
const std::array<float, 256>& ByteThresholds() {
  static const std::array<float, 256> thresholds = [] {
    std::array<float, 256> t{};
    for (int b = 1; b < 256; ++b) t[b] = LinearChannel((static_cast<float>(b) - 0.5f) / 255.0f);
    return t;
  }();
  return thresholds;
}

// Diffuse light of a wide source: still reaches a little past the terminator.
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
  // Horizontal right and forward of the camera; looking straight down, the picture's up leads.
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
  // Blinn's highlight of the key with exponent 32, and light that grazes the outline.
  float gloss = std::max(0.0f, normal.dot((to_key + to_eye).normalized()));
  for (int k = 0; k < 5; ++k) gloss *= gloss;
  const float facing = std::clamp(1.0f - normal.dot(to_eye), 0.0f, 1.0f);
  const float rim = facing * facing * facing * std::max(0.0f, normal.dot(to_rim));
  return albedo.cwiseProduct(diffuse) +
         Eigen::Vector3f::Constant(0.07f * key * gloss + 0.25f * rim);
}

}  // namespace holdfast
