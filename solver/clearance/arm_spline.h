// SPDX-License-Identifier: MIT
#pragma once

#include <utility>
#include <vector>

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "solver/clearance/arm_change.h"

namespace holdfast {

/// Control points of an arm's change stay small and change little from one to the next.
///
///   r = [c_1 / sigma;  (c_0 - 2 c_1 + c_2) / (bend sigma)],   24 residuals
///
/// Parameter blocks: c_0, c_1, c_2 (12 each). `sigma`: per degree of freedom, radians.
class ArmSplinePrior final : public ceres::SizedCostFunction<24, 12, 12, 12> {
 public:
  ArmSplinePrior(const ArmChange& sigma, double bend)
      : inverse_(sigma.cwiseInverse()), bend_(bend) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    using Map = Eigen::Map<const ArmChange>;
    const Map c0(parameters[0]), c1(parameters[1]), c2(parameters[2]);
    Eigen::Map<Eigen::Matrix<double, 24, 1>> r(residuals);
    r << c1.cwiseProduct(inverse_), (c0 - 2.0 * c1 + c2).cwiseProduct(inverse_) / bend_;
    for (int k = 0; jacobians != nullptr && k < 3; ++k) {
      if (jacobians[k] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 24, 12, Eigen::RowMajor>> J(jacobians[k]);
      J.setZero();
      if (k == 1) J.topRows<12>().diagonal() = inverse_;
      J.bottomRows<12>().diagonal() = (k == 1 ? -2.0 : 1.0) / bend_ * inverse_;
    }
    return true;
  }

 private:
  ArmChange inverse_;
  double bend_;
};

/// How an arm is changed over time: a uniform cubic B-spline with a control point every
/// `knot_frames` frames, zero to begin with.
class ArmSpline {
 public:
  ArmSpline(int num_frames, double knot_frames)
      : knot_frames_(knot_frames),
        knots_(static_cast<std::size_t>((num_frames - 1) / knot_frames) + 4, ArmChange::Zero()) {}

  /// The first of the four control points around frame t, and what each counts.
  std::pair<int, Eigen::Vector4d> Place(int t) const {
    const double place = t / knot_frames_;
    const int knot = std::min(static_cast<int>(place), Size() - 4);
    const double u = place - knot, v = 1.0 - u;
    return {knot, Eigen::Vector4d(v * v * v, 3.0 * u * u * u - 6.0 * u * u + 4.0,
                                  3.0 * v * v * v - 6.0 * v * v + 4.0, u * u * u) /
                      6.0};
  }
  ArmChange At(int t) const {
    const auto [knot, basis] = Place(t);
    ArmChange change = ArmChange::Zero();
    for (int k = 0; k < 4; ++k) change += basis(k) * knots_[knot + k];
    return change;
  }
  int Size() const { return static_cast<int>(knots_.size()); }
  double* Knot(int k) { return knots_[k].data(); }

 private:
  double knot_frames_;
  std::vector<ArmChange> knots_;
};

}  // namespace holdfast
