// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <gtest/gtest.h>

#include <Eigen/Core>

namespace holdfast::testing {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// Of parameter blocks, which are compared in their tangents; nullptr, or not in the list: none.
using Manifolds = std::vector<const ceres::Manifold*>;

inline const ceres::Manifold* ManifoldOf(const Manifolds& manifolds, std::size_t block) {
  return block < manifolds.size() ? manifolds[block] : nullptr;
}

/// Residuals at these parameters; NaN where they are not written.
inline Eigen::VectorXd ResidualsAt(const ceres::CostFunction& cost,
                                   const double* const* parameters) {
  Eigen::VectorXd residuals = Eigen::VectorXd::Constant(cost.num_residuals(), NAN);
  EXPECT_TRUE(cost.Evaluate(parameters, residuals.data(), nullptr));
  return residuals;
}
inline Eigen::VectorXd ResidualsAt(const ceres::CostFunction& cost,
                                   const std::vector<const double*>& parameters) {
  return ResidualsAt(cost, parameters.data());
}

/// Residuals, and the Jacobians of all blocks side by side; NaN where they are not written.
struct CostRows {
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
};
inline CostRows RowsAt(const ceres::CostFunction& cost, const double* const* parameters,
                       const Manifolds& manifolds = {}) {
  const int rows = cost.num_residuals();
  const std::vector<int>& sizes = cost.parameter_block_sizes();
  std::vector<RowMatrix> blocks;
  std::vector<double*> pointers;
  for (const int size : sizes) blocks.push_back(RowMatrix::Constant(rows, size, NAN));
  for (RowMatrix& J : blocks) pointers.push_back(J.data());
  CostRows all{Eigen::VectorXd::Constant(rows, NAN), Eigen::MatrixXd(rows, 0)};
  EXPECT_TRUE(cost.Evaluate(parameters, all.r.data(), pointers.data()));
  for (std::size_t b = 0; b < sizes.size(); ++b) {
    RowMatrix J = blocks[b];
    if (const ceres::Manifold* const manifold = ManifoldOf(manifolds, b)) {
      RowMatrix plus(sizes[b], manifold->TangentSize());
      manifold->PlusJacobian(parameters[b], plus.data());
      J = (blocks[b] * plus).eval();
    }
    all.J.conservativeResize(Eigen::NoChange, all.J.cols() + J.cols());
    all.J.rightCols(J.cols()) = J;
  }
  return all;
}

/// Central differences of a function of the residuals, a column for each number of the tangents.
template <typename Function>
Eigen::MatrixXd DifferencesOf(const ceres::CostFunction& cost,
                              const std::vector<double*>& parameters, const Manifolds& manifolds,
                              double step, const Function& of) {
  const std::vector<int>& sizes = cost.parameter_block_sizes();
  Eigen::MatrixXd all;
  for (std::size_t b = 0; b < sizes.size(); ++b) {
    const ceres::Manifold* const manifold = ManifoldOf(manifolds, b);
    const Eigen::VectorXd start = Eigen::Map<Eigen::VectorXd>(parameters[b], sizes[b]);
    const int tangent = manifold ? manifold->TangentSize() : sizes[b];
    for (int c = 0; c < tangent; ++c) {
      Eigen::VectorXd side[2];
      for (const int s : {0, 1}) {
        const Eigen::VectorXd delta = Eigen::VectorXd::Unit(tangent, c) * (s ? step : -step);
        Eigen::VectorXd moved = start + (manifold ? Eigen::VectorXd::Zero(sizes[b]) : delta);
        if (manifold) manifold->Plus(start.data(), delta.data(), moved.data());
        std::copy(moved.begin(), moved.end(), parameters[b]);
        side[s] = of(ResidualsAt(cost, parameters.data()));
      }
      all.conservativeResize(side[0].size(), all.cols() + 1);
      all.rightCols<1>() = (side[1] - side[0]) / (2.0 * step);
    }
    std::copy(start.begin(), start.end(), parameters[b]);
  }
  return all;
}

/// The gradient of the cost, half the sum of squares, by central differences.
inline Eigen::VectorXd CostGradientAt(const ceres::CostFunction& cost,
                                      const std::vector<double*>& parameters,
                                      const Manifolds& manifolds, double step) {
  return DifferencesOf(cost, parameters, manifolds, step,
                       [](const Eigen::VectorXd& r) {
                         return Eigen::VectorXd::Constant(1, 0.5 * r.squaredNorm());
                       })
      .transpose();
}

/// Largest difference between a cost function's Jacobian and central differences with one small
/// step (hinges and interpolated data have corners that larger steps see), over all blocks,
/// relative to the block's largest entry.
inline double JacobianError(const ceres::CostFunction& cost, const std::vector<double*>& parameters,
                            const Manifolds& manifolds = {}, double step = 1e-7) {
  const Eigen::MatrixXd J = RowsAt(cost, parameters.data(), manifolds).J,
                        numeric = DifferencesOf(cost, parameters, manifolds, step,
                                                [](const Eigen::VectorXd&r) { return r; });
  double worst = 0.0;
  Eigen::Index column = 0;
  for (std::size_t b = 0; b < parameters.size(); ++b) {
    const ceres::Manifold* const manifold = ManifoldOf(manifolds, b);
    const int size = manifold ? manifold->TangentSize() : cost.parameter_block_sizes()[b];
    const auto expected = numeric.middleCols(column, size);
    const double error = (J.middleCols(column, size) - expected).cwiseAbs().maxCoeff() /
                         std::max(expected.cwiseAbs().maxCoeff(), 1e-12);
    if (!(error <= worst)) worst = error;
    column += size;
  }
  return worst;
}

}  // namespace holdfast::testing
