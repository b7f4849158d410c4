// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include "generator/wandr/rotation_6d.h"

namespace holdfast::wandr {

/// The heading frame of a body with root rotation R = Rz(a) Ry(b) Rx(g): Z = Rz(a), a the azimuth
/// of the body's lateral axis R e_x. The body faces -y of it: h = -Z e_y. Undefined only while the
/// lateral axis is vertical, lying on one's side.
template <typename T>
struct Heading {
  T cosine = T(1);
  T sine = T(0);
  /// a(R Exp(phi)) = a(R) + gradient . phi: (0, R21, R22) / (R00^2 + R10^2).
  Vector3<T> gradient = Vector3<T>::Zero();

  /// Z v: from the heading frame into the world.
  Vector3<T> ToWorld(const Vector3<T>& v) const {
    return {cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y(), v.z()};
  }
  /// Z^T v: from the world into the heading frame.
  Vector3<T> FromWorld(const Vector3<T>& v) const {
    return {cosine * v.x() + sine * v.y(), cosine * v.y() - sine * v.x(), v.z()};
  }
  /// h = -Z e_y, where the body faces, a horizontal unit vector.
  Vector3<T> Forward() const { return {sine, -cosine, T(0)}; }
};

template <typename T>
Heading<T> HeadingOf(const Matrix3<T>& root) {
  const T squared = std::max(root(0, 0) * root(0, 0) + root(1, 0) * root(1, 0), T(1e-12));
  const T inverse = T(1) / std::sqrt(squared);
  Heading<T> heading;
  heading.cosine = root(0, 0) * inverse;
  heading.sine = root(1, 0) * inverse;
  heading.gradient = Vector3<T>(T(0), root(2, 1), root(2, 2)) / squared;
  return heading;
}

/// R_xy = Z^T R = Ry(b) Rx(g), the root without its heading; entry (1, 0) is 0, and exactly so (its
/// standard deviation is 0, and dividing rounding by it would make noise of it).
template <typename T>
Matrix3<T> WithoutHeading(const Heading<T>& heading, const Matrix3<T>& root) {
  Matrix3<T> R_xy;
  R_xy.row(0) = heading.cosine * root.row(0) + heading.sine * root.row(1);
  R_xy.row(1) = heading.cosine * root.row(1) - heading.sine * root.row(0);
  R_xy.row(2) = root.row(2);
  R_xy(1, 0) = T(0);
  return R_xy;
}

/// phi_bar of the root from six_bar of rows12(R_xy): R_xy's own perturbation is
/// (I - r3 gradient^T) phi, r3 = R^T e_z. The gradient of the entry that is always 0 is left out.
template <typename T>
Vector3<T> WithoutHeadingVjp(const Heading<T>& heading, const Matrix3<T>& R_xy,
                             const Vector6<T>& six_bar) {
  Vector6<T> bar = six_bar;
  bar[3] = T(0);
  const Vector3<T> psi_bar = Rows12Vjp<T>(R_xy, bar);
  return psi_bar - heading.gradient * R_xy.row(2).dot(psi_bar.transpose());
}

/// a_bar from y_bar, where y = Z^T v for a v that stays: dy = -(e_z x y) da.
template <typename T>
T TurnVjp(const Vector3<T>& y, const Vector3<T>& y_bar) {
  return y.y() * y_bar.x() - y.x() * y_bar.y();
}

}  // namespace holdfast::wandr
