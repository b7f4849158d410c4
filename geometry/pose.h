// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace holdfast {

/// x -> rotation x + translation.
inline Eigen::Isometry3d RigidTransform(const Eigen::Matrix3d& rotation,
                                        const Eigen::Vector3d& translation) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.linear() = rotation;
  transform.translation() = translation;
  return transform;
}

/// x -> rotation (x - point) + place: what puts `point` at `place`.
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
