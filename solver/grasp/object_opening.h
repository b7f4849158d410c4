// SPDX-License-Identifier: MIT
#pragma once

#include "solver/grasp/object_shape.h"

namespace holdfast {

/// What can be filled: surface from which straight up is free and every way across is not.
struct ObjectOpening {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double share = 0.0;             ///< of the surface that is inside
  double floor = 0.0, rim = 0.0;  ///< along up, metres
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double radius = 0.0;
  bool Any() const { return share > 0.1 && rim - floor > 0.010; }
};

/// Up where the object stands if it is open there, else where it is open most.
ObjectOpening FindOpening(const ObjectShape& shape);

}  // namespace holdfast
