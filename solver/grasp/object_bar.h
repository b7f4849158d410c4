// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include "solver/grasp/object_shape.h"

namespace holdfast {

/// What is beyond a bar at one end, and how far it stands out; metres.
struct BeyondBar {
  double length = 0.0, reach = 0.0;
  int count = 0;                                  ///< points of it
  Eigen::Vector3d off = Eigen::Vector3d::Zero();  ///< the middle of it, from the bar's line

  double Bulk() const { return length < 0.012 ? 0.0 : length + reach; }
};

/// A run of slices that a hand closes around.
struct ObjectBar {
  ShapeSlices slices;
  int first = 0, last = -1;                        ///< of the run
  Eigen::Vector3d line = Eigen::Vector3d::Zero();  ///< of its middle line, at 0 along the axis
  double wide = 0.0;                               ///< mean
  double bend = 0.0;                               ///< how far its middles are from a straight line
  std::array<BeyondBar, 2> ends;                   ///< below, above

  double Length() const { return (last - first + 1) * slices.Step(); }
  AxisSpan Run() const { return {slices.Low(first), slices.Low(last + 1)}; }
  /// Thin between two things that stand out.
  bool Waist() const;
};

/// The longest bar of an object, over all directions: cuts straight across it, since slanting ones
/// make a blade look thick. Without slices where nothing of it is one.
ObjectBar FindBar(const ObjectShape& shape);

}  // namespace holdfast
