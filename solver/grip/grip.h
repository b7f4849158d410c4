// SPDX-License-Identifier: MIT
#pragma once

/// A grip: contacts of a hand's links with an object go in; a squeeze that balances itself, and how
/// far the object's weight moves it in a hand whose joints are springs, come out.

#include <vector>

#include <Eigen/Geometry>

namespace holdfast {

/// Where a link touches the object, in the hand's frame.
struct GripContact {
  int link = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d into = Eigen::Vector3d::Zero();   ///< unit, into the object
  Eigen::Vector3d press = Eigen::Vector3d::Zero();  ///< force that the link should exert there, N
};

/// The squeeze: pushes and friction at the contacts that balance each other on the object as well
/// as can be, each contact taking its share. With g the 4 edges of the friction cone of each
/// contact, f >= 0 of least 100 |sum_g f_g w_g|^2 + sum_g (f_g - 1/4)^2, wrenches w about `centre`
/// with torques over `radius_m`; then scaled so that the pushes (along `into`) sum to `grip_N`.
/// After BODex (Chen et al. 2024), which also makes its squeeze by bilevel balance of forces.
void BalancePresses(const Eigen::Vector3d& centre, double radius_m, double friction, double grip_N,
                    std::vector<GripContact>& contacts);

}  // namespace holdfast
