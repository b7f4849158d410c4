// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

#include "solver/terms/skin_distance.h"

namespace holdfast {

/// r = w max(0, clearance - d): skin below the surface by more than -clearance is pushed out.
/// A negative clearance is what soft tissue may give.
struct PenetrationShape {
  double weight = 1.0;     ///< per metre
  double clearance = 0.0;  ///< metres

  std::pair<double, double> operator()(double distance) const {
    const double depth = clearance - distance;
    if (depth <= 0.0) return {0.0, 0.0};
    return {weight * depth, -weight};
  }
};

/// Hand in object: E = sum_i w^2 max(0, clearance - d_i)^2 over points of the skin.
using PenetrationTerm = SkinDistanceTerm<PenetrationShape>;

}  // namespace holdfast
