// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "meshes/make/body/loft.h"

namespace holdfast {

/// A shape built stroke by stroke, as a sculptor adds and takes away clay: each stroke is blended
/// into all that came before it with its own fillet. Points and widths in metres; the value is
/// negative inside and close to the signed distance near the surface.
class Sculpture {
 public:
  using Field = std::function<double(const Eigen::Vector3d&)>;

  Sculpture() = default;
  /// All strokes lie within the box: farther than `margin` from it the box is answer enough.
  Sculpture(const Eigen::AlignedBox3d& bounds, double margin) : bounds_(bounds), margin_(margin) {}

  void Add(Field field, double fillet) { strokes_.push_back({std::move(field), fillet, false}); }
  void Carve(Field field, double fillet) { strokes_.push_back({std::move(field), fillet, true}); }

  double operator()(const Eigen::Vector3d& point) const {
    if (!bounds_.isEmpty()) {
      const double outside = bounds_.exteriorDistance(point);
      if (outside > margin_) return outside;
    }
    double value = 1e3;
    for (const Stroke& stroke : strokes_) {
      const double other = stroke.field(point);
      value = stroke.carve ? SmoothIntersection(value, -other, stroke.fillet)
                           : SmoothUnion(value, other, stroke.fillet);
    }
    return value;
  }

 private:
  struct Stroke {
    Field field;
    double fillet;
    bool carve;
  };
  Eigen::AlignedBox3d bounds_;
  double margin_ = 0;
  std::vector<Stroke> strokes_;
};

/// An ellipsoid as a stroke; the columns of `axes` are the directions of the semi axes.
inline Sculpture::Field Ellipsoid(const Eigen::Vector3d& centre, const Eigen::Vector3d& semi_axes,
                                  const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity()) {
  return [=](const Eigen::Vector3d& p) {
    return EllipsoidDistance(axes.transpose() * (p - centre), semi_axes);
  };
}

}  // namespace holdfast
