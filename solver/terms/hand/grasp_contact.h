// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

#include "solver/terms/hand/skin_distance.h"

namespace holdfast {

/// r = w (d - target): points of a pad are drawn onto the surface from either side.
struct GraspContactShape {
  double weight = 1.0;  ///< per metre
  double target = 0.0;  ///< metres; slightly negative presses the pad's soft tissue

  std::pair<double, double> operator()(double distance) const {
    return {weight * (distance - target), weight};
  }
};

/// Pads on the surface: E = sum_i w^2 (d_i - target)^2 over the points chosen to touch.
using GraspContactTerm = SkinDistanceTerm<GraspContactShape>;

}  // namespace holdfast
