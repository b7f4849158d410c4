// SPDX-License-Identifier: MIT
#include "solver/unknowns/change_spline.h"

#include <algorithm>

namespace holdfast {
namespace {

constexpr int kSize = UpperBodyDofs::kSize;
constexpr std::size_t kHeldKnots = 3;  // at either end: zero value, velocity and acceleration

// Weights of the four control points around a position between two of them.
Eigen::Vector4d CubicBasis(double u) {
  const double v = 1.0 - u;
  return {v * v * v / 6.0, (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0,
          (3.0 * v * v * v - 6.0 * v * v + 4.0) / 6.0, u * u * u / 6.0};
}

}  // namespace

ChangeSplinePrior::ChangeSplinePrior(const UpperBodyChange& sigma, double bend)
    : sigma_(sigma), bend_(bend) {
  set_num_residuals(2 * kSize);
  mutable_parameter_block_sizes()->assign(3, kSize);
}

bool ChangeSplinePrior::Evaluate(double const* const* parameters, double* residuals,
                                 double** jacobians) const {
  const Eigen::Map<const UpperBodyChange> before(parameters[0]), now(parameters[1]),
      after(parameters[2]);
  Eigen::Map<Eigen::Matrix<double, 2 * kSize, 1>> r(residuals);
  r.head<kSize>() = now.cwiseQuotient(sigma_);
  r.tail<kSize>() = (before - 2.0 * now + after).cwiseQuotient(sigma_) / bend_;
  if (jacobians == nullptr) return true;
  const UpperBodyChange inverse = sigma_.cwiseInverse();
  for (int k = 0; k < 3; ++k) {
    if (jacobians[k] == nullptr) continue;
    Eigen::Map<Eigen::Matrix<double, 2 * kSize, kSize, Eigen::RowMajor>> J(jacobians[k]);
    J.setZero();
    if (k == 1) J.topRows<kSize>().diagonal() = inverse;
    J.bottomRows<kSize>().diagonal() = (k == 1 ? -2.0 : 1.0) / bend_ * inverse;
  }
  return true;
}

ChangeSpline::ChangeSpline(int num_frames, int knot_frames)
    : knot_frames_(knot_frames),
      knots_(static_cast<std::size_t>(
                 std::max(1, (num_frames - 1 + knot_frames - 1) / knot_frames) + 3),
             UpperBodyChange::Zero()) {}

std::pair<std::size_t, Eigen::Vector4d> ChangeSpline::Place(int t) const {
  const double place = static_cast<double>(t) / knot_frames_;
  const auto knot = std::min(static_cast<std::size_t>(place), knots_.size() - 4);
  return {knot, CubicBasis(place - static_cast<double>(knot))};
}

UpperBodyChange ChangeSpline::At(int t) const {
  const auto [knot, basis] = Place(t);
  UpperBodyChange change = UpperBodyChange::Zero();
  for (int k = 0; k < 4; ++k) change += basis(k) * knots_[knot + static_cast<std::size_t>(k)];
  return change;
}

void ChangeSpline::AddTo(ceres::Problem& problem) {
  for (UpperBodyChange& knot : knots_) problem.AddParameterBlock(knot.data(), kSize);
}

void ChangeSpline::AddPrior(ceres::Problem& problem, const UpperBodyChange& sigma, double bend) {
  for (std::size_t k = 1; k + 1 < knots_.size(); ++k) {
    problem.AddResidualBlock(new ChangeSplinePrior(sigma, bend), nullptr, knots_[k - 1].data(),
                             knots_[k].data(), knots_[k + 1].data());
  }
}

void ChangeSpline::HoldStart(ceres::Problem& problem) {
  for (std::size_t k = 0; k < kHeldKnots; ++k) problem.SetParameterBlockConstant(knots_[k].data());
}

void ChangeSpline::HoldEnd(ceres::Problem& problem) {
  for (std::size_t k = knots_.size() - kHeldKnots; k < knots_.size(); ++k) {
    problem.SetParameterBlockConstant(knots_[k].data());
  }
}

}  // namespace holdfast
