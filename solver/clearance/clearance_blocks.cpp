// SPDX-License-Identifier: MIT
#include "solver/clearance/clearance_blocks.h"

#include <utility>

namespace holdfast {
namespace {

ArmChange Blend(double const* const* knots, const Eigen::Vector4d& basis) {
  ArmChange change = ArmChange::Zero();
  for (int k = 0; k < 4; ++k) change += basis(k) * Eigen::Map<const ArmChange>(knots[k]);
  return change;
}

void Spread(const ArmRows& J, const Eigen::Vector4d& basis, double** jacobians) {
  for (int k = 0; k < 4; ++k) {
    if (jacobians[k] != nullptr) Eigen::Map<ArmRows>(jacobians[k], J.rows(), 12) = basis(k) * J;
  }
}

}  // namespace

ClearanceBlock::ClearanceBlock(const ArmFrame& frame, DepthInBody depth, const HandStay& stay,
                               const ArmRange& range, const Eigen::Vector4d& basis)
    : frame_(frame), depth_(std::move(depth)), stay_(stay), range_(range), basis_(basis) {
  set_num_residuals(depth_.Rows() + HandStay::kRows + ArmRange::kRows);
  mutable_parameter_block_sizes()->assign(4, 12);
}

bool ClearanceBlock::Evaluate(double const* const* parameters, double* residuals,
                              double** jacobians) const {
  const ArmChange change = Blend(parameters, basis_);
  ArmState state;
  state.Evaluate(frame_, change);
  Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
  ArmRows J(num_residuals(), 12);
  const int n = depth_.Rows();
  depth_.Evaluate(state, r.head(n), J.topRows(n));
  stay_.Evaluate(state, r.segment<HandStay::kRows>(n), J.middleRows<HandStay::kRows>(n));
  range_.Evaluate(change, r.tail<ArmRange::kRows>(), J.bottomRows<ArmRange::kRows>());
  if (jacobians != nullptr) Spread(J, basis_, jacobians);
  return true;
}

ClosureBlock::ClosureBlock(const ArmFrame& right, const ArmFrame& left, const HandClosure& closure,
                           const Eigen::Vector4d& basis)
    : right_(right), left_(left), closure_(closure), basis_(basis) {
  set_num_residuals(HandClosure::kRows);
  mutable_parameter_block_sizes()->assign(8, 12);
}

bool ClosureBlock::Evaluate(double const* const* parameters, double* residuals,
                            double** jacobians) const {
  ArmState right, left;
  right.Evaluate(right_, Blend(parameters, basis_));
  left.Evaluate(left_, Blend(parameters + 4, basis_));
  Eigen::Map<Eigen::Matrix<double, HandClosure::kRows, 1>> r(residuals);
  ArmRows J_right(HandClosure::kRows, 12), J_left(HandClosure::kRows, 12);
  closure_.Evaluate(right, left, r, J_right, J_left);
  if (jacobians == nullptr) return true;
  Spread(J_right, basis_, jacobians);
  Spread(J_left, basis_, jacobians + 4);
  return true;
}

}  // namespace holdfast
