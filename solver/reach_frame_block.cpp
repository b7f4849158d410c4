// SPDX-License-Identifier: MIT
#include "solver/reach_frame_block.h"

namespace holdfast {
namespace {

constexpr int kSize = ReachDofs::kSize;
using JacobianRows = Eigen::Matrix<double, ReachFrameBlock::kRows, kSize, Eigen::RowMajor>;

}  // namespace

ReachFrameBlock::ReachFrameBlock(const ReachChain& chain, const BodyFrame& captured,
                                 const ReachFrameTerms& terms, const Eigen::Vector4d& basis)
    : chain_(chain), captured_(captured), terms_(terms), basis_(basis) {
  set_num_residuals(kRows);
  mutable_parameter_block_sizes()->assign(4, kSize);
}

bool ReachFrameBlock::Evaluate(double const* const* parameters, double* residuals,
                               double** jacobians) const {
  ReachChange change = ReachChange::Zero();
  for (int k = 0; k < 4; ++k) change += basis_(k) * Eigen::Map<const ReachChange>(parameters[k]);
  ReachState state;
  state.Evaluate(chain_, captured_, change);
  Eigen::Map<Eigen::Matrix<double, kRows, 1>> r(residuals);
  JacobianRows J;
  int row = 0;
  const auto add = [&](const auto& term, auto... more) {
    constexpr int kTermRows = std::decay_t<decltype(term)>::kRows;
    term.Evaluate(chain_, state, more..., r.template segment<kTermRows>(row),
                  J.template middleRows<kTermRows>(row));
    row += kTermRows;
  };
  add(terms_.wrist);
  add(terms_.gaze);
  add(terms_.legs);
  add(terms_.balance);
  add(terms_.range, change);
  if (jacobians == nullptr) return true;
  for (int k = 0; k < 4; ++k) {
    if (jacobians[k] != nullptr) Eigen::Map<JacobianRows>{jacobians[k]} = basis_(k) * J;
  }
  return true;
}

ReachSplinePrior::ReachSplinePrior(const ReachChange& sigma, double bend)
    : sigma_(sigma), bend_(bend) {
  set_num_residuals(2 * kSize);
  mutable_parameter_block_sizes()->assign(3, kSize);
}

bool ReachSplinePrior::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const Eigen::Map<const ReachChange> before(parameters[0]), now(parameters[1]),
      after(parameters[2]);
  Eigen::Map<Eigen::Matrix<double, 2 * kSize, 1>> r(residuals);
  r.head<kSize>() = now.cwiseQuotient(sigma_);
  r.tail<kSize>() = (before - 2.0 * now + after).cwiseQuotient(sigma_) / bend_;
  if (jacobians == nullptr) return true;
  const ReachChange inverse = sigma_.cwiseInverse();
  for (int k = 0; k < 3; ++k) {
    if (jacobians[k] == nullptr) continue;
    Eigen::Map<Eigen::Matrix<double, 2 * kSize, kSize, Eigen::RowMajor>> J(jacobians[k]);
    J.setZero();
    if (k == 1) J.topRows<kSize>().diagonal() = inverse;
    J.bottomRows<kSize>().diagonal() = (k == 1 ? -2.0 : 1.0) / bend_ * inverse;
  }
  return true;
}

}  // namespace holdfast
