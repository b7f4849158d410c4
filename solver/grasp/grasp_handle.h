// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"

namespace holdfast {

/// A bar with an opening behind it that fingers go through: a mug's or a jug's handle. What a pan
/// or a hammer has is a bar alone, and no handle here. Object frame, meters.
struct Handle {
  Eigen::Vector3d bar;      ///< in the middle of the bar
  Eigen::Vector3d along;    ///< unit, the bar's own direction
  Eigen::Vector3d inward;   ///< unit, orthogonal to `along`: from the bar into the opening
  Eigen::Vector3d through;  ///< unit, orthogonal to both: the way fingers take
  double thickness;         ///< of the bar along `inward`
  double width;             ///< of the bar along `through`
  double room;              ///< from the bar's inner face to what lies across the opening
  double low, high;         ///< along the bar, from `bar`: where a finger fits behind it

  double Length() const { return high - low; }
};

struct HandleOptions {
  double finger_radius_m =
      0.0075;                   ///< of the thinnest finger that counts: openings below take none
  double max_opening_m = 0.12;  ///< across: wider ones are held by what surrounds them
  double max_bar_m = 0.035;     ///< thickness of a bar, in any direction across it
  double step_m = 0.004;        ///< of the grid that openings are looked for on
  int count = 5;                ///< different places on bars kept, the longest first
  int threads = 1;
};

/// Finds handles of any shape, watertight or not, from distances alone. A point is in an opening
/// when a finger passes straight through it, both ways, and every ray across that direction meets
/// the object: so it is for a tunnel, and neither for the inside of a cup (its floor stops the
/// finger) nor for a hook. A bar is what such a ray meets first, if its cross-section is small and
/// free all round. Deterministic; empty when there is no handle.
std::vector<Handle> FindHandles(const DistanceGrid& object, const HandleOptions& options = {});

/// Whether a chain of points (finger joints and tip, object frame) passes behind the bar, through
/// the opening.
bool PassesThrough(const Handle& handle, const Eigen::Matrix3Xd& chain);

}  // namespace holdfast
