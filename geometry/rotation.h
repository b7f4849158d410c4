// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>

/// Rotations: axis-angle in files, matrices in between, tangent increments in solvers. All act on
/// column vectors. Jacobian names read "d out / d in" (J_out_in).
namespace holdfast {

inline constexpr double kDegree = std::numbers::pi / 180.0;  ///< radians

/// [v]x, the matrix with [v]x w = v x w.
template <typename T>
Eigen::Matrix<T, 3, 3> Skew(const Eigen::Matrix<T, 3, 1>& v) {
  Eigen::Matrix<T, 3, 3> m;
  m << T(0), -v.z(), v.y(), v.z(), T(0), -v.x(), -v.y(), v.x(), T(0);
  return m;
}

/// exp([w]x) by Rodrigues' formula, exact to rounding at any angle.
Eigen::Matrix3d ExpSO3(const Eigen::Vector3d& w);

/// The axis-angle of least angle (in [0, pi]) with ExpSO3(LogSO3(R)) = R.
Eigen::Vector3d LogSO3(const Eigen::Matrix3d& R);

/// Left Jacobian J of SO(3): exp([w + dw]x) = exp([J dw]x) exp([w]x) to first order (Sola, Deray,
/// Atchuthan 2018, eq. 145).
Eigen::Matrix3d LeftJacobianSO3(const Eigen::Vector3d& w);

/// Inverse of LeftJacobianSO3; finite for angles below 2 pi.
Eigen::Matrix3d InverseLeftJacobianSO3(const Eigen::Vector3d& w);

/// The rotation nearest to M in the Frobenius norm, determinant +1 (SVD).
Eigen::Matrix3d NearestRotation(const Eigen::Matrix3d& M);

/// The rotation of least angle from the direction of `from` to that of `to`; about any
/// perpendicular axis if they are opposite. (Eigen's version instantiates an SVD in each file that
/// calls it.)
Eigen::Quaterniond RotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// The equivalent axis-angle (w + 2 pi k axis) nearest to `reference`: removes jumps along a clip.
Eigen::Vector3d UnwrapAxisAngle(const Eigen::Vector3d& w, const Eigen::Vector3d& reference);

/// Angle between two rotations, radians in [0, pi].
double AngleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b);

/// x -> rotation x + translation.
inline Eigen::Isometry3d RigidTransform(const Eigen::Matrix3d& rotation,
                                        const Eigen::Vector3d& translation) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.linear() = rotation;
  transform.translation() = translation;
  return transform;
}

/// x -> rotation (x - point) + place: maps `point` to `place`.
inline Eigen::Isometry3d PoseAt(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& point,
                                const Eigen::Vector3d& place) {
  return RigidTransform(rotation, place - rotation * point);
}

/// world_from_object: x_world = orientation * x_object + translation.
struct ObjectPose {
  ObjectPose() = default;
  ObjectPose(const Eigen::Quaterniond& q, const Eigen::Vector3d& T)
      : orientation(q), translation(T) {}
  explicit ObjectPose(const Eigen::Isometry3d& world_from_object)
      : orientation(world_from_object.linear()), translation(world_from_object.translation()) {}

  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Isometry3d Transform() const {
    return RigidTransform(orientation.toRotationMatrix(), translation);
  }
};

}  // namespace holdfast
