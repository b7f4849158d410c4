// SPDX-License-Identifier: MIT
#include "solver/action_frame_block.h"

namespace holdfast {
namespace {

constexpr int kSize = ReachDofs::kSize;
using JacobianRows = Eigen::Matrix<double, ActionFrameBlock::kRows, kSize, Eigen::RowMajor>;

}  // namespace

ActionFrameBlock::ActionFrameBlock(const ReachChain& chain, const BodyFrame& base,
                                   const ActionFrameTerms& terms, const Eigen::Vector4d& basis)
    : chain_(chain), base_(base), terms_(terms), basis_(basis) {
  set_num_residuals(kRows);
  mutable_parameter_block_sizes()->assign(4, kSize);
}

bool ActionFrameBlock::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  ReachChange change = ReachChange::Zero();
  for (int k = 0; k < 4; ++k) change += basis_(k) * Eigen::Map<const ReachChange>(parameters[k]);
  ReachState state;
  state.Evaluate(chain_, base_, change);
  Eigen::Map<Eigen::Matrix<double, kRows, 1>> r(residuals);
  JacobianRows J;
  int row = 0;
  const auto add = [&](const auto& term, auto... more) {
    constexpr int kTermRows = std::decay_t<decltype(term)>::kRows;
    term.Evaluate(chain_, state, more..., r.template segment<kTermRows>(row),
                  J.template middleRows<kTermRows>(row));
    row += kTermRows;
  };
  add(terms_.hand);
  add(terms_.gaze);
  add(terms_.lean);
  add(terms_.legs);
  add(terms_.balance);
  add(terms_.range, change);
  if (jacobians == nullptr) return true;
  for (int k = 0; k < 4; ++k) {
    if (jacobians[k] != nullptr) Eigen::Map<JacobianRows>{jacobians[k]} = basis_(k) * J;
  }
  return true;
}

}  // namespace holdfast
