// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// A cross-section of a loft, millimetres: at which height, how far the centre lies off the axis,
/// and the half width in each of the four directions; `power` 2 is an ellipse, more is boxier.
struct Section {
  double at;
  double u_centre, v_centre;
  double u_minus, u_plus;
  double v_minus, v_plus;
  double power = 2.0;
};

/// A body swept along a straight axis with smoothly changing sections, rounded at both ends.
/// Evaluates to an estimate of the signed distance, metres, negative inside, exact to first order
/// near the surface.
class Loft {
 public:
  /// Axis from `begin` towards `end` (metres); u and v are the given hints made perpendicular to
  /// it. Sections are ordered by `at`, measured from `begin`; the caps stand out by the given
  /// lengths.
  Loft(const Eigen::Vector3d& begin, const Eigen::Vector3d& end, const Eigen::Vector3d& u_hint,
       const Eigen::Vector3d& v_hint, const std::vector<Section>& sections_mm, double begin_cap_mm,
       double end_cap_mm);

  double operator()(const Eigen::Vector3d& point) const;

 private:
  static constexpr int kChannels = 7;
  using Channels = Eigen::Matrix<double, kChannels, 1>;

  Channels Interpolate(double at) const;

  Eigen::Vector3d origin_, u_, v_, w_;
  std::vector<double> at_;
  std::vector<Channels> values_, slopes_;
  double begin_cap_, end_cap_;
};

/// An ellipsoid; `point` in its frame (centre at the origin, along the semi axes). The estimate of
/// the signed distance is exact to first order near the surface.
double EllipsoidDistance(const Eigen::Vector3d& point, const Eigen::Vector3d& semi_axes);

/// Union with a fillet of about `width` (twice differentiable; exact where |a - b| >= width).
double SmoothUnion(double a, double b, double width);
/// Intersection with a rounded edge of about `width`.
double SmoothIntersection(double a, double b, double width);

}  // namespace holdfast
