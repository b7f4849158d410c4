// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <ceres/sized_cost_function.h>

#include "solver/hand/hand_axes.h"

namespace holdfast {

/// A finger joint keeps to its range.
///
///   r = sqrt(w) (a - clamp(a)),   3 residuals, radians
///
/// Parameter block: the joint's angles a (3, as a column of HandAngles).
class AngleRangeTerm final : public ceres::SizedCostFunction<3, 3> {
 public:
  /// `axes` must outlive the term.
  AngleRangeTerm(const HandAxes& axes, int finger_joint, double weight)
      : axes_(axes), joint_(finger_joint), scale_(std::sqrt(weight)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    double* const J = jacobians != nullptr ? jacobians[0] : nullptr;
    if (J != nullptr) std::fill_n(J, 9, 0.0);
    for (int k = 0; k < 3; ++k) {
      const AngleRange& range = axes_.Range(k, joint_);
      const double beyond = parameters[0][k] - std::clamp(parameters[0][k], range.low, range.high);
      residuals[k] = scale_ * beyond;
      if (J != nullptr && beyond != 0.0) J[4 * k] = scale_;
    }
    return true;
  }

 private:
  const HandAxes& axes_;
  int joint_;
  double scale_;
};

}  // namespace holdfast
