// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "geometry/render/camera.h"

namespace holdfast {

/// sRGB in [0, 1] to linear light and back to a byte (IEC 61966-2-1). Out of range is clamped.
Eigen::Vector3f LinearFromSrgb(const Eigen::Vector3d& srgb);
std::uint8_t SrgbByteFromLinear(float linear);

/// A portrait photographer's light, in linear RGB: a warm key above the viewer's left shoulder, a
/// cool fill from the right, a rim from behind, and a hemisphere of sky and ground. It turns with
/// the camera about the vertical, so every view is lit alike.
struct Lighting {
  Eigen::Vector3f to_key, to_fill, to_rim;  ///< unit, world

  explicit Lighting(const View& view);

  /// Light reflected towards the eye by a matt, slightly glossy surface. `normal` and `to_eye` are
  /// unit, world; `albedo` linear; `key` the share of the key light that arrives (shadows).
  Eigen::Vector3f Shade(const Eigen::Vector3f& albedo, const Eigen::Vector3f& normal,
                        const Eigen::Vector3f& to_eye, float key = 1.0f) const;
};

}  // namespace holdfast
