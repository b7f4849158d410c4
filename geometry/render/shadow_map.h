// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Shadows that meshes cast on each other under one distant light: how near to the light the first
/// surface is, on a grid seen from it (Williams 1978), compared over a few cells for soft edges
/// (Reeves, Salesin & Cook 1987).
class ShadowMap {
 public:
  /// `to_light`: unit direction towards the light; `finest_m`: no cell is smaller.
  ShadowMap(std::span<const TriangleMesh* const> meshes, const Eigen::Vector3d& to_light,
            double finest_m = 0.0);

  /// Share of the light that arrives at a surface point with this unit normal, 0..1.
  float Light(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;

 private:
  // Share of a box three cells wide around (x, y) that is lit at `height`; slides smoothly.
  float Tap(double x, double y, float height) const;

  Eigen::Matrix3d light_from_world_;  // rows: two axes across the light, then towards it
  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();
  double cell_m_ = 1.0;
  int size_ = 0;
  std::vector<float> nearest_;  // size_ x size_: coordinate towards the light; empty: no shadow
};

}  // namespace holdfast
