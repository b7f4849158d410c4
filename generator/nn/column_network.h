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

/// A network ready to run on N columns at a time, of whatever architecture. Const, shared by any
/// number of threads; each has a Tape of its own. Nothing is allocated after construction. A
/// column's result does not depend, to the last bit, on which others are computed beside it.
template <typename Real>
class ColumnNetwork {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

  /// The room that a run takes.
  struct Room {
    std::vector<int> levels;     ///< rows of each block of activations: the input, .., the output
    int num_norms = 0;           ///< normalizations: a mean and a deviation of each column
    std::vector<int> gradients;  ///< rows of each block needed to run backwards
  };

  virtual ~ColumnNetwork() = default;

  int InputSize() const { return room_.levels.front(); }
  int OutputSize() const { return room_.levels.back(); }
  /// Multiply-adds of one column.
  virtual long NumProducts() const = 0;

  /// Runs the columns in tape.Input(); the result is tape.Output().
  virtual void Forward(Tape<Real>& tape) const = 0;

  /// The vector-Jacobian product at what Forward last ran on `tape`. Columns of `output_gradient`
  /// (OutputSize() x N m) are consecutive, m to each column of the tape: rows of a residual.
  /// Writes `input_gradient` (InputSize() x N m). Exact but at kinks of rectifiers.
  virtual void Backward(const Tape<Real>& tape, const Eigen::Ref<const Matrix>& output_gradient,
                        Eigen::Ref<Matrix> input_gradient, Scratch<Real>& scratch) const = 0;

  const Room& RoomNeeded() const { return room_; }

 protected:
  ColumnNetwork() = default;
  ColumnNetwork(const ColumnNetwork&) = default;
  ColumnNetwork& operator=(const ColumnNetwork&) = default;

  Room room_;
};

/// The one that runs `weights`; `isa` for tests and measurements.
template <typename Real>
std::unique_ptr<const ColumnNetwork<Real>> MakeNetwork(const AnyWeights& weights,
                                                       Isa isa = BestIsa());

/// Columns of activations, the rows of each padded to whole vectors; padding is never read as data.
template <typename Real>
struct Columns {
  Real* data;
  long stride;
  int rows;
};

/// Room for one run of a network on up to `max_columns` columns: its activations, and the means and
/// deviations of its normalizations. Running backwards reads it, so a rollout keeps one per step.
template <typename Real>
class Tape {
 public:
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Map = Eigen::Map<Matrix, Eigen::Aligned16, Eigen::OuterStride<>>;
  using ConstMap = Eigen::Map<const Matrix, Eigen::Aligned16, Eigen::OuterStride<>>;

  Tape(const ColumnNetwork<Real>& network, int max_columns);

  /// Columns of the next run, at most max_columns.
  void Resize(int num_columns);
  int NumColumns() const { return num_columns_; }
  Map Input() { return {values_.data(), rows_.front(), num_columns_, Stride(0)}; }
  ConstMap Output() const {
    const std::size_t last = rows_.size() - 1;
    return {values_.data() + begin_[last], rows_[last], num_columns_, Stride(last)};
  }

  // For networks alone.
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

/// Room for running backwards with up to `max_gradients` columns.
template <typename Real>
class Scratch {
 public:
  Scratch(const ColumnNetwork<Real>& network, int max_gradients);

  int MaxGradients() const { return max_gradients_; }
  // For networks alone.
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
