// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/mesh.h"
#include "geometry/render/camera.h"

namespace holdfast {

/// Converts sRGB in [0, 1] to linear light, and back to a byte (IEC 61966-2-1), with clamping.
Eigen::Vector3f LinearFromSrgb(const Eigen::Vector3d& srgb);
std::uint8_t SrgbByteFromLinear(float linear);

/// Portrait lighting in linear RGB: a warm key light above the viewer's left shoulder, a cool fill
/// light from the right, a rim light from behind, and a sky/ground hemisphere. It rotates with the
/// camera about the vertical, so that every view is lit alike.
struct Lighting {
  Eigen::Vector3f to_key, to_fill, to_rim;  ///< unit, world

  explicit Lighting(const View& view);

  /// Light reflected towards the eye by a matte, slightly glossy surface. `normal` and `to_eye` are
  /// unit, world; `albedo` is linear; `key` is the fraction of the key light that arrives
  /// (shadows).
  Eigen::Vector3f Shade(const Eigen::Vector3f& albedo, const Eigen::Vector3f& normal,
                        const Eigen::Vector3f& to_eye, float key = 1.0f) const;
};

/// Shadow map of one distant light: depth of the surface nearest to the light on a grid (Williams
/// 1978), with percentage-closer filtering for soft edges (Reeves, Salesin & Cook 1987).
class ShadowMap {
 public:
  /// `to_light`: unit direction towards the light; `finest_m`: minimum cell size.
  ShadowMap(std::span<const TriangleMesh* const> meshes, const Eigen::Vector3d& to_light,
            double finest_m = 0.0);

  /// Fraction of the light that arrives at a surface point with this unit normal, 0..1.
  float Light(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;

 private:
  // Lit fraction, at `height`, of a box three cells wide around (x, y); continuous in x and y.
  float Tap(double x, double y, float height) const;

  Eigen::Matrix3d light_from_world_;  // rows: two axes across the light, then towards it
  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();
  double cell_m_ = 1.0;
  int size_ = 0;
  std::vector<float> nearest_;  // size_ x size_: coordinate towards the light; empty: no shadow
};

/// Shadow of meshes on a horizontal plane: the cast shadow along one direction, with the soft edge
/// of a wide light, and ambient occlusion close beneath the meshes. Both are rendered once into a
/// small map of the plane and blurred.
class GroundShadow {
 public:
  /// `to_light`: unit direction towards the light, z > 0. Vertices below the plane are ignored.
  GroundShadow(std::span<const TriangleMesh* const> meshes, double ground_height_m,
               const Eigen::Vector3d& to_light);

  /// Fraction of light that arrives at (x, y) of the plane, in (0, 1]; 1 far from all meshes.
  float Light(double x, double y) const;

 private:
  static constexpr int kSize = 256;

  double left_ = 0.0, bottom_ = 0.0;
  double cells_per_meter_ = 0.0;
  std::vector<float> light_;  // kSize x kSize, row-major from (left, bottom); empty: no shadow
};

}  // namespace holdfast
