// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

/// Rotations as six numbers, the first two rows: rows12(R) = (R00, R01, R02, R10, R11, R12). (Zhou
/// et al. 2019 use columns instead.) Derivatives of a rotation are right perturbations, R Exp(phi),
/// phi in radians in the frame that R maps from; x_bar is the gradient with respect to x.
namespace holdfast::wandr {

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <typename T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;
template <typename T>
using Vector6 = Eigen::Matrix<T, 6, 1>;

/// rows12(R).
template <typename T>
Vector6<T> Rows12(const Matrix3<T>& R) {
  Vector6<T> six;
  six << R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2);
  return six;
}

/// GS(six): b1 = a1/|a1|, n = a2 - (b1.a2) b1, b2 = n/|n|, b3 = b1 x b2 are the rows of R. Norms
/// are bounded below by 1e-12.
template <typename T>
Matrix3<T> RotationFromRows12(const Vector6<T>& six) {
  const Vector3<T> a1 = six.template head<3>(), a2 = six.template tail<3>();
  const Vector3<T> b1 = a1 / std::max(a1.norm(), T(1e-12));
  const Vector3<T> n = a2 - b1.dot(a2) * b1;
  const Vector3<T> b2 = n / std::max(n.norm(), T(1e-12));
  Matrix3<T> R;
  R.row(0) = b1;
  R.row(1) = b2;
  R.row(2) = b1.cross(b2);
  return R;
}

/// Orthonormalizes a product of rotations by GS, which removes rounding errors.
template <typename T>
Matrix3<T> Orthonormalized(const Matrix3<T>& R) {
  return RotationFromRows12<T>(Rows12<T>(R));
}

/// six_bar from psi_bar, where GS(six + d) = GS(six) Exp(psi), psi = J_GS d (3 x 6) with
///   psi = b1 ((b1.a2)/(|a1||n|) b3.da1 - b3.da2/|n|) + b2 b3.da1/|a1| - b3 b2.da1/|a1|.
template <typename T>
Vector6<T> RotationFromRows12Vjp(const Vector6<T>& six, const Vector3<T>& psi_bar) {
  const Vector3<T> a1 = six.template head<3>(), a2 = six.template tail<3>();
  const T a1_norm = std::max(a1.norm(), T(1e-12));
  const Vector3<T> b1 = a1 / a1_norm;
  const T along = b1.dot(a2);
  const Vector3<T> n = a2 - along * b1;
  const T n_norm = std::max(n.norm(), T(1e-12));
  const Vector3<T> b2 = n / n_norm, b3 = b1.cross(b2);
  const T s1 = b1.dot(psi_bar), s2 = b2.dot(psi_bar), s3 = b3.dot(psi_bar);
  Vector6<T> six_bar;
  six_bar.template head<3>() = ((s1 * along / n_norm + s2) * b3 - s3 * b2) / a1_norm;
  six_bar.template tail<3>() = (-s1 / n_norm) * b3;
  return six_bar;
}

/// phi_bar from six_bar, where rows12(R Exp(phi)) = rows12(R) + ([m1]x; [m2]x) phi, m_i = row i of
/// R.
template <typename T>
Vector3<T> Rows12Vjp(const Matrix3<T>& R, const Vector6<T>& six_bar) {
  const Vector3<T> m1 = R.row(0), m2 = R.row(1);
  return six_bar.template head<3>().cross(m1) + six_bar.template tail<3>().cross(m2);
}

}  // namespace holdfast::wandr
