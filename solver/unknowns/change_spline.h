// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Core>

#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// Prior on control points: small and smooth.
///
///   r = [c_1 / sigma;  (c_0 - 2 c_1 + c_2) / (bend sigma)],   56 residuals
///
/// Parameter blocks: c_0, c_1, c_2 (28 each). `sigma`: per degree of freedom, meters or radians.
class ChangeSplinePrior final : public ceres::CostFunction {
 public:
  ChangeSplinePrior(const UpperBodyChange& sigma, double bend);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  UpperBodyChange sigma_;
  double bend_;
};

/// Change of a motion over time: a cubic B-spline of changes (UpperBodyDofs, 28) with a control
/// point every `knot_frames` frames, initially zero.
class ChangeSpline {
 public:
  ChangeSpline(int num_frames, int knot_frames);

  /// Change of frame t, relative to the first frame of the spline.
  UpperBodyChange At(int t) const;

  /// Adds the control points to `problem` as parameter blocks. Must be called first.
  void AddTo(ceres::Problem& problem);
  /// Adds a residual block on frame t's four control points, created by make(basis): a FrameBlock.
  template <typename Make>
  void AddFrame(ceres::Problem& problem, int t, const Make& make) {
    const auto [knot, basis] = Place(t);
    problem.AddResidualBlock(make(basis), nullptr, knots_[knot].data(), knots_[knot + 1].data(),
                             knots_[knot + 2].data(), knots_[knot + 3].data());
  }
  /// Adds ChangeSplinePrior for all control points but the outermost.
  void AddPrior(ceres::Problem& problem, const UpperBodyChange& sigma, double bend);
  /// Fixes the change and its first two derivatives to zero at the start or the end.
  void HoldStart(ceres::Problem& problem);
  void HoldEnd(ceres::Problem& problem);

 private:
  // Index of the first of the four control points around frame t, and their weights.
  std::pair<std::size_t, Eigen::Vector4d> Place(int t) const;

  int knot_frames_;
  std::vector<UpperBodyChange> knots_;
};

}  // namespace holdfast
