// SPDX-License-Identifier: MIT
#include "geometry/rotation.h"

#include <array>
#include <numbers>

#include <Eigen/SVD>

namespace holdfast {
namespace {

// sin(a)/a, (1 - cos a)/a^2 and (a - sin a)/a^3 as functions of a^2. Taylor below 1e-2 rad^2, where
// the closed forms of the last two begin to cancel (the first omitted term is under 1e-17).
std::array<double, 3> Coefficients(double a2) {
  if (a2 < 1e-2) {
    return {
        1.0 - a2 / 6.0 *
                  (1.0 - a2 / 20.0 * (1.0 - a2 / 42.0 * (1.0 - a2 / 72.0 * (1.0 - a2 / 110.0)))),
        0.5 - a2 / 24.0 *
                  (1.0 - a2 / 30.0 * (1.0 - a2 / 56.0 * (1.0 - a2 / 90.0 * (1.0 - a2 / 132.0)))),
        1.0 / 6.0 -
            a2 / 120.0 *
                (1.0 - a2 / 42.0 * (1.0 - a2 / 72.0 * (1.0 - a2 / 110.0 * (1.0 - a2 / 156.0))))};
  }
  const double a = std::sqrt(a2);
  return {std::sin(a) / a, (1.0 - std::cos(a)) / a2, (a - std::sin(a)) / (a2 * a)};
}

}  // namespace

Eigen::Matrix3d ExpSO3(const Eigen::Vector3d& w) {
  const auto [sinc, cosc, sinc3] = Coefficients(w.squaredNorm());
  const Eigen::Matrix3d W = Skew(w);
  return Eigen::Matrix3d::Identity() + sinc * W + cosc * W * W;
}

Eigen::Vector3d LogSO3(const Eigen::Matrix3d& R) {
  // Via the quaternion: well conditioned at 0 and at pi, unlike the trace formula.
  Eigen::Quaterniond q(R);
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double s = q.vec().norm();
  if (s < 1e-8) return 2.0 * q.vec();
  return 2.0 * std::atan2(s, q.w()) / s * q.vec();
}

Eigen::Matrix3d LeftJacobianSO3(const Eigen::Vector3d& w) {
  const auto [sinc, cosc, sinc3] = Coefficients(w.squaredNorm());
  const Eigen::Matrix3d W = Skew(w);
  return Eigen::Matrix3d::Identity() + cosc * W + sinc3 * W * W;
}

Eigen::Matrix3d InverseLeftJacobianSO3(const Eigen::Vector3d& w) {
  const double a2 = w.squaredNorm();
  double k;  // (1 - (a/2) cot(a/2)) / a^2
  if (a2 < 1e-2) {
    k = 1.0 / 12.0 + a2 / 720.0 * (1.0 + a2 / 42.0 * (1.0 + a2 / 40.0));
  } else {
    const double half = 0.5 * std::sqrt(a2);
    k = (1.0 - half / std::tan(half)) / a2;
  }
  const Eigen::Matrix3d W = Skew(w);
  return Eigen::Matrix3d::Identity() - 0.5 * W + k * W * W;
}

Eigen::Matrix3d NearestRotation(const Eigen::Matrix3d& M) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) signs.z() = -1.0;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

Eigen::Quaterniond RotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

Eigen::Vector3d UnwrapAxisAngle(const Eigen::Vector3d& w, const Eigen::Vector3d& reference) {
  const double angle = w.norm();
  const Eigen::Vector3d axis = angle > 1e-12 ? Eigen::Vector3d(w / angle)
                               : reference.norm() > 1e-12
                                   ? Eigen::Vector3d(reference.normalized())
                                   : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  const double turns = std::round((axis.dot(reference) - angle) / (2.0 * std::numbers::pi));
  return (angle + 2.0 * std::numbers::pi * turns) * axis;
}

double AngleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return LogSO3(a.transpose() * b).norm();
}

}  // namespace holdfast
