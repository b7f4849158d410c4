// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"

namespace holdfast {

/// A bar with an opening behind it for fingers, as on a mug or a jug. The plain bar of a pan or a
/// hammer is not a handle here. Object frame, meters.
struct Handle {
  Eigen::Vector3d bar;      ///< center of the bar
  Eigen::Vector3d along;    ///< unit, direction of the bar
  Eigen::Vector3d inward;   ///< unit, orthogonal to `along`: from the bar into the opening
  Eigen::Vector3d through;  ///< unit, orthogonal to both: direction of fingers through the opening
  double thickness;         ///< of the bar along `inward`
  double width;             ///< of the bar along `through`
  double room;              ///< from the bar's inner face to the far side of the opening
  double low, high;         ///< along the bar, from `bar`: where a finger fits behind it

  double Length() const { return high - low; }
};

/// Finds handles of any shape, watertight or not, from distances alone. A point is in an opening
/// when a finger passes straight through it, both ways, and every ray orthogonal to that direction
/// meets the object. This holds for a tunnel, but neither for the inside of a cup (its floor stops
/// the finger) nor for a hook. A bar is what such a ray meets first, if its cross-section is small
/// and has free space all around. Deterministic; empty if there is no handle; else at most five
/// places on bars, longest first.
std::vector<Handle> FindHandles(const DistanceGrid& object, int threads = 1);

/// Whether a chain of points (finger joints and tip, object frame) passes behind the bar, through
/// the opening.
bool PassesThrough(const Handle& handle, const Eigen::Matrix3Xd& chain);

}  // namespace holdfast
