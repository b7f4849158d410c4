// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// How dark a horizontal plane gets under meshes: the shadow they cast along one direction, with
/// the soft edge of a wide light, and the dimming of ambient light close beneath them. Both are
/// drawn once into a small map of the plane and blurred.
class GroundShadow {
 public:
  /// `to_light`: unit direction towards the light, z > 0. Vertices below the plane cast nothing.
  GroundShadow(std::span<const TriangleMesh* const> meshes, double ground_height_m,
               const Eigen::Vector3d& to_light);

  /// Fraction of light that arrives at (x, y) of the plane, in (0, 1]; 1 away from everything.
  float Light(double x, double y) const;

 private:
  static constexpr int kSize = 256;

  double left_ = 0.0, bottom_ = 0.0;
  double cells_per_metre_ = 0.0;
  std::vector<float> light_;  // kSize x kSize, row-major from (left, bottom); empty when no shadow
};

}  // namespace holdfast
