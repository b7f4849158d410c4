// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "generator/nn/network_weights.h"
#include "generator/nn/packed_matrix.h"
#include "geometry/isa.h"

namespace holdfast::nn {

template <typename Real>
class Tape;
template <typename Real>
class Scratch;

/// A network of any architecture, prepared to run on N columns at a time. Immutable and safe to
/// share between threads; each thread needs its own Tape. Allocates only in the constructor. The
/// result of a column does not depend on the other columns, bit for bit.
template <typename Real>
class ColumnNetwork {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

  /// Sizes of the buffers that a run needs.
  struct Room {
    std::vector<int> levels;     ///< rows of each block of activations, from input to output
    int num_norms = 0;           ///< normalizations, each with a mean and deviation per column
    std::vector<int> gradients;  ///< rows of each block of gradients (backward pass)
  };

  virtual ~ColumnNetwork() = default;

  int InputSize() const { return room_.levels.front(); }
  int OutputSize() const { return room_.levels.back(); }
  /// Number of multiply-adds per column.
  virtual long NumProducts() const = 0;

  /// Runs the network on the columns of tape.Input() and writes tape.Output().
  virtual void Forward(Tape<Real>& tape) const = 0;

  /// Vector-Jacobian product at the inputs of the last Forward on `tape`. `output_gradient`
  /// (OutputSize() x N m) holds m consecutive columns for each column of the tape (rows of a
  /// residual). Writes `input_gradient` (InputSize() x N m). Exact except at kinks of rectifiers.
  virtual void Backward(const Tape<Real>& tape, const Eigen::Ref<const Matrix>& output_gradient,
                        Eigen::Ref<Matrix> input_gradient, Scratch<Real>& scratch) const = 0;

  const Room& RoomNeeded() const { return room_; }

 protected:
  ColumnNetwork() = default;
  ColumnNetwork(const ColumnNetwork&) = default;
  ColumnNetwork& operator=(const ColumnNetwork&) = default;

  Room room_;
};

/// Creates the network for `weights`. `isa` is set only by tests and benchmarks.
template <typename Real>
std::unique_ptr<const ColumnNetwork<Real>> MakeNetwork(const AnyWeights& weights,
                                                       Isa isa = BestIsa());

/// Columns of activations. Rows are padded to whole vectors; padding is never read as data.
template <typename Real>
struct Columns {
  Real* data;
  long stride;
  int rows;
};

/// Buffers for one forward pass on up to `max_columns` columns: activations, and normalization
/// means and deviations. The backward pass reads them, so a rollout keeps one tape per step.
template <typename Real>
class Tape {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Map = Eigen::Map<Matrix, Eigen::Aligned16, Eigen::OuterStride<>>;
  using ConstMap = Eigen::Map<const Matrix, Eigen::Aligned16, Eigen::OuterStride<>>;

  Tape(const ColumnNetwork<Real>& network, int max_columns);

  /// Sets the number of columns of the next run, at most max_columns.
  void Resize(int num_columns);
  int NumColumns() const { return num_columns_; }
  Map Input() { return {values_.data(), rows_.front(), num_columns_, Stride(0)}; }
  ConstMap Output() const {
    const std::size_t last = rows_.size() - 1;
    return {values_.data() + begin_[last], rows_[last], num_columns_, Stride(last)};
  }

  // Used by networks only.
  Columns<Real> Level(int level) {
    return {values_.data() + begin_[level], PaddedRows(rows_[level]), rows_[level]};
  }
  Columns<const Real> Level(int level) const {
    return {values_.data() + begin_[level], PaddedRows(rows_[level]), rows_[level]};
  }
  Real* Mean(int norm) { return mean_.data() + At(norm); }
  const Real* Mean(int norm) const { return mean_.data() + At(norm); }
  Real* InverseDeviation(int norm) { return inverse_deviation_.data() + At(norm); }
  const Real* InverseDeviation(int norm) const { return inverse_deviation_.data() + At(norm); }
  int* Visited() { return visited_.data(); }

 private:
  Eigen::OuterStride<> Stride(std::size_t level) const {
    return Eigen::OuterStride<>(PaddedRows(rows_[level]));
  }
  std::size_t At(int norm) const { return static_cast<std::size_t>(norm) * max_columns_; }

  std::vector<int> rows_;           // of each level
  std::vector<std::size_t> begin_;  // in values_
  int max_columns_;
  int num_columns_;
  AlignedArray<Real> values_;
  AlignedArray<Real> mean_, inverse_deviation_;  // per normalization and column
  std::vector<int> visited_;
};

/// Buffers for a backward pass with up to `max_gradients` columns.
template <typename Real>
class Scratch {
 public:
  Scratch(const ColumnNetwork<Real>& network, int max_gradients);

  int MaxGradients() const { return max_gradients_; }
  // Used by networks only.
  Columns<Real> Gradient(int which) {
    return {gradients_[which].data(), PaddedRows(rows_[which]), rows_[which]};
  }
  int* Visited() { return visited_.data(); }

 private:
  std::vector<int> rows_;
  int max_gradients_;
  std::vector<AlignedArray<Real>> gradients_;
  std::vector<int> visited_;
};

extern template class Tape<float>;
extern template class Tape<double>;
extern template class Scratch<float>;
extern template class Scratch<double>;
extern template std::unique_ptr<const ColumnNetwork<float>> MakeNetwork(const AnyWeights&, Isa);
extern template std::unique_ptr<const ColumnNetwork<double>> MakeNetwork(const AnyWeights&, Isa);

}  // namespace holdfast::nn
