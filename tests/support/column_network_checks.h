// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "generator/nn/column_network.h"
#include "geometry/parallel.h"
#include "tests/support/wandr_scene.h"

/// What every network that runs on columns must do.
namespace holdfast::nn::testing {

inline std::vector<Isa> SupportedIsas() {
  std::vector<Isa> all;
  for (const Isa isa : {Isa::kScalar, Isa::kSse2, Isa::kAvx2, Isa::kAvx512}) {
    if (IsSupported(isa)) all.push_back(isa);
  }
  return all;
}

template <typename Real>
Eigen::MatrixXd RunNetwork(const ColumnNetwork<Real>& network, const Eigen::MatrixXd& x) {
  Tape<Real> tape(network, static_cast<int>(x.cols()));
  tape.Input() = x.cast<Real>();
  network.Forward(tape);
  return tape.Output().template cast<double>();
}

/// The vector-Jacobian products at `x`, rows of residuals consecutive for each column of it.
template <typename Real>
Eigen::MatrixXd RunBackward(const ColumnNetwork<Real>& network, const Eigen::MatrixXd& x,
                            const Eigen::MatrixXd& rows) {
  using Matrix = typename ColumnNetwork<Real>::Matrix;
  Tape<Real> tape(network, static_cast<int>(x.cols()));
  tape.Input() = x.cast<Real>();
  network.Forward(tape);
  Scratch<Real> scratch(network, static_cast<int>(rows.cols()));
  const Matrix y_bar = rows.cast<Real>();
  Matrix x_bar = Matrix::Constant(x.rows(), rows.cols(), static_cast<Real>(NAN));
  network.Backward(tape, y_bar, x_bar, scratch);
  return x_bar.template cast<double>();
}

/// To the last bit, in batches of several sizes.
inline void CheckColumnsAreAlone(const ColumnNetwork<float>& network, const Eigen::MatrixXd& x) {
  const Eigen::MatrixXd all = RunNetwork(network, x);
  for (const int size : {1, 2, 4, 9}) {
    for (int first = 0; first + size <= x.cols(); first += size) {
      EXPECT_EQ(RunNetwork(network, x.middleCols(first, size)), all.middleCols(first, size))
          << size << " of " << x.cols() << " columns";
    }
  }
}

/// Against central differences of `reference`, two rows for each of three columns.
template <typename Reference>
void CheckBackward(const ColumnNetwork<double>& network, const Reference& reference) {
  const int input = network.InputSize();
  const Eigen::MatrixXd x = Eigen::MatrixXd::Random(input, 3),
                        rows = Eigen::MatrixXd::Random(network.OutputSize(), 6),
                        found = RunBackward(network, x, rows);
  for (int c = 0; c < 6; ++c) {
    const auto value = [&](const Eigen::VectorXd& step) {
      return rows.col(c).dot(reference(x.col(c / 2) + step));
    };
    EXPECT_LT(
        wandr::testing::RelativeError(found.col(c), wandr::testing::NumericGradient(value, input)),
        1e-7);
  }
}

/// In single precision against double, relative to the norm of all.
inline double SingleGradientError(const ColumnNetwork<float>& single,
                                  const ColumnNetwork<double>& exact) {
  // The same inputs to both: drawn in single precision.
  const Eigen::MatrixXd x = Eigen::MatrixXf::Random(exact.InputSize(), 9).cast<double>(),
                        rows = Eigen::MatrixXf::Random(exact.OutputSize(), 9).cast<double>();
  const Eigen::MatrixXd expected = RunBackward(exact, x, rows);
  return (RunBackward(single, x, rows) - expected).norm() / expected.norm();
}

}  // namespace holdfast::nn::testing
