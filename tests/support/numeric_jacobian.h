// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <ceres/cost_function.h>
#include <ceres/manifold.h>

#include <Eigen/Core>

namespace holdfast::testing {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Largest difference between a cost function's Jacobian and central differences with one small
/// step (hinges and interpolated data have corners that larger steps see), over all blocks,
/// relative to the block's largest entry. Blocks with a manifold (nullptr: none) are compared in
/// its tangent. Outputs are poisoned first: an entry that is not written gives NaN.
inline double JacobianError(const ceres::CostFunction& cost, const std::vector<double*>& parameters,
                            const std::vector<const ceres::Manifold*>& manifolds,
                            double step = 1e-7) {
  const int rows = cost.num_residuals();
  const std::vector<int>& sizes = cost.parameter_block_sizes();
  std::vector<RowMatrix> analytic;
  std::vector<double*> pointers;
  for (const int size : sizes) analytic.push_back(RowMatrix::Constant(rows, size, NAN));
  for (RowMatrix& J : analytic) pointers.push_back(J.data());
  Eigen::VectorXd residuals = Eigen::VectorXd::Constant(rows, NAN);
  if (!cost.Evaluate(parameters.data(), residuals.data(), pointers.data())) return NAN;

  double worst = 0.0;
  for (std::size_t b = 0; b < sizes.size(); ++b) {
    const ceres::Manifold* const manifold = manifolds[b];
    const Eigen::VectorXd start = Eigen::Map<Eigen::VectorXd>(parameters[b], sizes[b]);
    const int tangent = manifold ? manifold->TangentSize() : sizes[b];
    RowMatrix numeric(rows, tangent), J = analytic[b];
    if (manifold) {
      RowMatrix plus(sizes[b], tangent);
      manifold->PlusJacobian(start.data(), plus.data());
      J = (analytic[b] * plus).eval();
    }
    for (int c = 0; c < tangent; ++c) {
      Eigen::VectorXd side[2];
      for (const int s : {0, 1}) {
        const Eigen::VectorXd delta = Eigen::VectorXd::Unit(tangent, c) * (s ? step : -step);
        Eigen::VectorXd moved = start + (manifold ? Eigen::VectorXd::Zero(sizes[b]) : delta);
        if (manifold) manifold->Plus(start.data(), delta.data(), moved.data());
        std::copy(moved.begin(), moved.end(), parameters[b]);
        side[s].setConstant(rows, NAN);
        cost.Evaluate(parameters.data(), side[s].data(), nullptr);
      }
      numeric.col(c) = (side[1] - side[0]) / (2.0 * step);
    }
    std::copy(start.begin(), start.end(), parameters[b]);
    const double error =
        (J - numeric).cwiseAbs().maxCoeff() / std::max(numeric.cwiseAbs().maxCoeff(), 1e-12);
    if (!(error <= worst)) worst = error;
  }
  return worst;
}

}  // namespace holdfast::testing
