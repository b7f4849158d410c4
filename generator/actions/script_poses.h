// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/pose.h"

namespace holdfast {

/// Poses of an object that put one of its points somewhere. All directions are unit or made so.

/// The rotation that takes `a` to `to_a` and `b` as near to `to_b` as that allows.
Eigen::Matrix3d AlignAxes(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                          const Eigen::Vector3d& to_a, const Eigen::Vector3d& to_b);

/// `count` poses, evenly round: the axis of the object points along `direction`, its turn about it
/// is free.
std::vector<Eigen::Isometry3d> TurnedPoses(const Eigen::Vector3d& point,
                                           const Eigen::Vector3d& axis,
                                           const Eigen::Vector3d& place,
                                           const Eigen::Vector3d& direction, int count);

/// Upright (z up), `count` turns about the vertical; then the same leant by each of `tilts_rad`
/// towards +x, -x, +y and -y of the world.
std::vector<Eigen::Isometry3d> UprightPoses(const Eigen::Vector3d& point,
                                            const Eigen::Vector3d& place, int count,
                                            const std::vector<double>& tilts_rad = {});

}  // namespace holdfast
