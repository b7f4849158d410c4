// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

namespace holdfast {

/// A place where the hand presses on the object, object frame.
struct GraspContact {
  Eigen::Vector3d point;
  Eigen::Vector3d inward;  ///< unit, the direction of the pressing force
};

/// How hard the weakest disturbance is to resist (Ferrari & Canny 1992): the radius of the largest
/// ball around the origin within the convex hull of the wrenches that unit forces within the
/// friction cones exert, torques taken about `centroid` and divided by `length` (metres). 0 without
/// force closure; about 0.1 to 0.5 for firm grasps. The ball is found by descent over directions
/// from fixed starts: an upper bound, tight in practice, and deterministic.
double WrenchQuality(std::span<const GraspContact> contacts, const Eigen::Vector3d& centroid,
                     double length, double friction = 0.5);

}  // namespace holdfast
