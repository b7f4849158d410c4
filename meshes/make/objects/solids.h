// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/Core>

/// Signed distance primitives and booleans. Lengths are millimetres, as in a product drawing;
/// negative is inside. Distances are exact outside simple solids and first-order elsewhere, which
/// is all a mesher needs: the sign, the zero set and a gradient that does not vanish near it.
namespace holdfast::solids {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;

/// A solid: negative inside, zero on the surface, positive outside.
using Field = std::function<double(const Vec3&)>;

inline double Union(double a, double b) { return std::min(a, b); }
inline double Intersection(double a, double b) { return std::max(a, b); }
inline double Difference(double a, double b) { return std::max(a, -b); }

/// Union whose seam is a fillet about `width` wide; equals min(a, b) where |a - b| >= width.
inline double SmoothUnion(double a, double b, double width) {
  const double overlap = std::max(width - std::abs(a - b), 0.0);
  return std::min(a, b) - overlap * overlap / (4.0 * width);
}
inline double SmoothIntersection(double a, double b, double width) {
  return -SmoothUnion(-a, -b, width);
}
inline double SmoothDifference(double a, double b, double width) {
  return -SmoothUnion(-a, b, width);
}

/// Intersection of two half-spaces-like distances whose edge is an exact round of radius `round`.
inline double RoundedIntersection(double a, double b, double round) {
  const double u = a + round;
  const double v = b + round;
  return std::min(std::max(u, v), 0.0) + std::hypot(std::max(u, 0.0), std::max(v, 0.0)) - round;
}

inline double Sphere(const Vec3& p, double radius) { return p.norm() - radius; }

/// First-order distance to an ellipsoid with the given semi-axes.
inline double Ellipsoid(const Vec3& p, const Vec3& semi_axes) {
  const double k0 = p.cwiseQuotient(semi_axes).norm();
  const double k1 = p.cwiseQuotient(semi_axes.cwiseAbs2()).norm();
  return k1 > 1e-12 ? k0 * (k0 - 1.0) / k1 : -semi_axes.minCoeff();
}

/// Box with half lengths `half`, every edge rounded with radius `round` (0: sharp).
inline double Box(const Vec3& p, const Vec3& half, double round = 0.0) {
  const Vec3 q = p.cwiseAbs() - half + Vec3::Constant(round);
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - round;
}

inline double Rectangle(const Vec2& p, const Vec2& half, double corner_radius) {
  const Vec2 q = p.cwiseAbs() - half + Vec2::Constant(corner_radius);
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - corner_radius;
}

/// A flat shape (its distance in the plane) pulled along the axis it was drawn across: `height` is
/// the coordinate on that axis, the rims are rounded with radius `round`.
inline double Extrusion(double flat_distance, double height, double half_height,
                        double round = 0.0) {
  return RoundedIntersection(flat_distance, std::abs(height) - half_height, round);
}

/// Cylinder around z, centred at the origin.
inline double Cylinder(const Vec3& p, double radius, double half_height, double round = 0.0) {
  return Extrusion(std::hypot(p.x(), p.y()) - radius, p.z(), half_height, round);
}

inline double Capsule(const Vec3& p, const Vec3& a, const Vec3& b, double radius_a,
                      double radius_b) {
  const Vec3 axis = b - a;
  const double t = std::clamp((p - a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return (p - a - t * axis).norm() - (radius_a + t * (radius_b - radius_a));
}

/// Ring around z.
inline double Torus(const Vec3& p, double ring_radius, double tube_radius) {
  return std::hypot(std::hypot(p.x(), p.y()) - ring_radius, p.z()) - tube_radius;
}

/// 0 below `from`, 1 above `to`, a smooth cubic between.
inline double SmoothStep(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace holdfast::solids
