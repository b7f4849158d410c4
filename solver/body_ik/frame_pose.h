// SPDX-License-Identifier: MIT
#pragma once

#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <ceres/cost_function.h>
#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "generator/wandr/pose.h"
#include "solver/unknowns/upper_body_chain.h"

namespace holdfast {

/// Converts a network's pose to a frame of the same body; `rest_pelvis` is J_0.
inline BodyFrame FrameOf(const wandr::Pose<double>& pose, const Eigen::Vector3d& rest_pelvis) {
  BodyFrame frame;
  frame.pelvis = pose.translation + rest_pelvis;
  for (std::size_t k = 0; k < kNumBodyJoints; ++k) {
    frame.local[k] = Eigen::Quaterniond(pose.rotation[k]);
  }
  return frame;
}

/// The inverse of FrameOf.
inline wandr::Pose<double> PoseOf(const BodyFrame& frame, const Eigen::Vector3d& rest_pelvis) {
  wandr::Pose<double> pose;
  pose.translation = frame.pelvis - rest_pelvis;
  for (std::size_t k = 0; k < kNumBodyJoints; ++k) {
    pose.rotation[k] = frame.local[k].toRotationMatrix();
  }
  return pose;
}

/// The terms of one frame as a function of the four control points of a cubic B-spline: the change
/// is x = sum_k basis_k c_k (ChangeSpline); or of the change itself, with one basis of 1.
/// Residuals: each term's kRows, in the order of the members of `Terms` (`Tied()`). Parameter
/// blocks: the control points (28 each, UpperBodyDofs). The body is evaluated once for all terms.
template <typename Terms>
class FrameBlock final : public ceres::CostFunction {
 public:
  static constexpr int kRows = []<typename... Term>(std::type_identity<std::tuple<Term...>>) {
    return (std::remove_cvref_t<Term>::kRows + ...);
  }(std::type_identity<decltype(std::declval<const Terms&>().Tied())>());

  /// `chain` and `base` (the unchanged frame) must outlive the block.
  FrameBlock(const UpperBodyChain& chain, const BodyFrame& base, const Terms& terms,
             const Eigen::VectorXd& basis)
      : chain_(chain), base_(base), terms_(terms), basis_(basis) {
    set_num_residuals(kRows);
    mutable_parameter_block_sizes()->assign(basis_.size(), UpperBodyDofs::kSize);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    UpperBodyChange change = UpperBodyChange::Zero();
    for (int k = 0; k < basis_.size(); ++k) {
      change += basis_(k) * Eigen::Map<const UpperBodyChange>(parameters[k]);
    }
    UpperBodyState state;
    state.Evaluate(chain_, base_, change);
    Eigen::Map<Eigen::Matrix<double, kRows, 1>> r(residuals);
    JacobianRows J;
    int row = 0;
    const auto evaluate = [&]<typename Term>(const Term& term) {
      auto rows = r.template segment<Term::kRows>(row);
      auto J_rows = J.template middleRows<Term::kRows>(row);
      if constexpr (requires { term.Evaluate(chain_, state, change, rows, J_rows); }) {
        term.Evaluate(chain_, state, change, rows, J_rows);
      } else {
        term.Evaluate(chain_, state, rows, J_rows);
      }
      row += Term::kRows;
    };
    std::apply([&](const auto&... term) { (evaluate(term), ...); }, terms_.Tied());
    if (jacobians == nullptr) return true;
    for (int k = 0; k < basis_.size(); ++k) {
      if (jacobians[k] != nullptr) Eigen::Map<JacobianRows>{jacobians[k]} = basis_(k) * J;
    }
    return true;
  }

 private:
  using JacobianRows = Eigen::Matrix<double, kRows, UpperBodyDofs::kSize, Eigen::RowMajor>;

  const UpperBodyChain& chain_;
  const BodyFrame& base_;
  Terms terms_;
  Eigen::VectorXd basis_;
};

/// Returns a smooth upper envelope of `values`: the maximum within `radius`, averaged by a
/// bell-shaped kernel of the same width. It rises from 2 `radius` before a value.
std::vector<double> Envelope(const std::vector<double>& values, int radius);

}  // namespace holdfast
