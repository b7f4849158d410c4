// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/nn/mlp_weights.h"
#include "generator/nn/packed_matrix.h"
#include "geometry/isa.h"

namespace holdfast::nn {

template <typename Real>
class MlpTape;
template <typename Real>
class MlpScratch;

/// A network ready to run on N columns at a time. Const, shared by any number of threads; each has
/// an MlpTape of its own. Nothing is allocated after construction.
///
/// The normalisation's gain and offset are folded into the products:
///   W norm(x) + b = s (W' x) - s mean(x) (W' 1) + b',  W' = W diag(gain), b' = b + W offset,
/// s = 1 / deviation, so that W' meets the rectified x itself, of which about half is zero and need
/// not be read for one column alone. A column's result does not depend on N.
template <typename Real>
class Mlp {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

  /// `isa` for tests and measurements; the best one by default.
  explicit Mlp(const MlpWeights& weights, Isa isa = BestIsa());

  int InputSize() const { return layers_.front().forward.Inner(); }
  int OutputSize() const { return layers_.back().forward.Rows(); }
  int NumLayers() const { return static_cast<int>(layers_.size()); }
  /// Multiply-adds of one column.
  long NumProducts() const;

  /// Runs the columns in tape.Input(); the result is tape.Output().
  void Forward(MlpTape<Real>& tape) const;

  /// The vector-Jacobian product at what Forward last ran on `tape`. Columns of `output_gradient`
  /// (OutputSize() x N m) are consecutive, m to each column of the tape: rows of a residual.
  /// Writes `input_gradient` (InputSize() x N m). Exact but at kinks of the rectifiers.
  void Backward(const MlpTape<Real>& tape, const Eigen::Ref<const Matrix>& output_gradient,
                Eigen::Ref<Matrix> input_gradient, MlpScratch<Real>& scratch) const;

 private:
  friend class MlpTape<Real>;
  friend class MlpScratch<Real>;

  struct Layer {
    PackedMatrix<Real> forward;   // W'
    PackedMatrix<Real> backward;  // W'^T
    AlignedArray<Real> row_sums;  // W' 1
    AlignedArray<Real> bias;      // b'
  };

  const kernels::LayerLoops<Real>* loops_;
  std::vector<Layer> layers_;
};

/// Room for one run of an Mlp on up to `max_columns` columns: each layer's input, its mean and
/// deviation. Running backwards reads it, so a rollout keeps one per step.
template <typename Real>
class MlpTape {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Map = Eigen::Map<Matrix, Eigen::Aligned16, Eigen::OuterStride<>>;
  using ConstMap = Eigen::Map<const Matrix, Eigen::Aligned16, Eigen::OuterStride<>>;

  MlpTape(const Mlp<Real>& mlp, int max_columns);

  /// Columns of the next run, at most max_columns.
  void Resize(int num_columns);
  int NumColumns() const { return num_columns_; }
  Map Input() { return {values_.data(), rows_.front(), num_columns_, Stride(0)}; }
  ConstMap Output() const {
    const std::size_t last = rows_.size() - 1;
    return {values_.data() + begin_[last], rows_[last], num_columns_, Stride(last)};
  }

 private:
  friend class Mlp<Real>;

  Eigen::OuterStride<> Stride(std::size_t level) const {
    return Eigen::OuterStride<>(PaddedRows(rows_[level]));
  }

  std::vector<int> rows_;           // of the input of each layer, and of the last one's output
  std::vector<std::size_t> begin_;  // in values_
  int max_columns_;
  int num_columns_;
  AlignedArray<Real> values_;
  AlignedArray<Real> mean_, inverse_deviation_;  // per layer and column
  std::vector<int> visited_;
};

/// Room for running backwards with up to `max_gradients` columns.
template <typename Real>
class MlpScratch {
 public:
  MlpScratch(const Mlp<Real>& mlp, int max_gradients);

 private:
  friend class Mlp<Real>;

  int max_gradients_;
  AlignedArray<Real> gradient_[2];
  std::vector<int> visited_;
};

extern template class Mlp<float>;
extern template class Mlp<double>;
extern template class MlpTape<float>;
extern template class MlpTape<double>;
extern template class MlpScratch<float>;
extern template class MlpScratch<double>;

}  // namespace holdfast::nn
