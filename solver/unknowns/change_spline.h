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

/// Control points stay small and change little from one to the next:
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

/// How a motion is changed over time: a cubic B-spline of changes (UpperBodyDofs, 28) with a
/// control point every `knot_frames` frames, zero to begin with.
class ChangeSpline {
 public:
  ChangeSpline(int num_frames, int knot_frames);

  /// The change of frame t, counted from the spline's first.
  UpperBodyChange At(int t) const;

  /// The control points become parameter blocks of `problem`. Call it first.
  void AddTo(ceres::Problem& problem);
  /// A block of frame t's four control points, made by make(basis): a FrameBlock.
  template <typename Make>
  void AddFrame(ceres::Problem& problem, int t, const Make& make) {
    const auto [knot, basis] = Place(t);
    problem.AddResidualBlock(make(basis), nullptr, knots_[knot].data(), knots_[knot + 1].data(),
                             knots_[knot + 2].data(), knots_[knot + 3].data());
  }
  /// ChangeSplinePrior of every control point but the outermost.
  void AddPrior(ceres::Problem& problem, const UpperBodyChange& sigma, double bend);
  /// The change vanishes at the start, or at the end, with its first two derivatives.
  void HoldStart(ceres::Problem& problem);
  void HoldEnd(ceres::Problem& problem);

 private:
  // The first of the four control points around frame t, and what each counts.
  std::pair<std::size_t, Eigen::Vector4d> Place(int t) const;

  int knot_frames_;
  std::vector<UpperBodyChange> knots_;
};

}  // namespace holdfast
