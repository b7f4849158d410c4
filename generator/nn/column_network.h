// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <stdexcept>
#include <vector>

#include <Eigen/Core>

#include "generator/nn/network_weights.h"
#include "generator/nn/packed_matrix.h"
#include "geometry/parallel.h"

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

  /// Runs the network on the columns of tape.Input() and writes tape.Output().
  virtual void Forward(Tape<Real>& tape) const = 0;

  /// Vector-Jacobian product at the inputs of the last Forward on `tape`. `output_gradient`
  /// (OutputSize() x N m) holds m consecutive columns for each column of the tape (rows of a
  /// residual). Writes `input_gradient` (InputSize() x N m). Exact except at kinks of rectifiers.
  /// Must not be called for the networks of IMoS, which have none.
  virtual void Backward(const Tape<Real>& /*tape*/,
                        const Eigen::Ref<const Matrix>& /*output_gradient*/,
                        Eigen::Ref<Matrix> /*input_gradient*/, Scratch<Real>& /*scratch*/) const {
    throw std::logic_error("this network has no gradient");
  }

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

/// A feed-forward chain of layers.
///
/// The gain and offset of the normalization are folded into the products:
///   W norm(x) + b = s (W' x) - s mean(x) (W' 1) + b',  W' = W diag(gain), b' = b + W offset,
/// where s = 1 / deviation. W' is then applied to the rectified x itself. About half of x is zero,
/// and those entries can be skipped for a single column.
template <typename Real>
class Mlp final : public ColumnNetwork<Real> {
 public:
  using Matrix = typename ColumnNetwork<Real>::Matrix;

  /// `isa` is set only by tests and benchmarks; the default is the best one.
  explicit Mlp(const MlpWeights& weights, Isa isa = BestIsa());

  int NumLayers() const { return static_cast<int>(layers_.size()); }
  void Forward(Tape<Real>& tape) const override;
  void Backward(const Tape<Real>& tape, const Eigen::Ref<const Matrix>& output_gradient,
                Eigen::Ref<Matrix> input_gradient, Scratch<Real>& scratch) const override;

 private:
  struct Layer {
    PackedMatrix<Real> forward;   // W'
    PackedMatrix<Real> backward;  // W'^T
    AlignedArray<Real> row_sums;  // W' 1
    AlignedArray<Real> bias;      // b'
  };

  const kernels::LayerLoops<Real>* loops_;
  std::vector<Layer> layers_;
};

extern template class Mlp<float>;
extern template class Mlp<double>;

/// A residual network (network_weights.h). The contributions of z to all blocks depend only on z
/// and are computed by one product; so is the gradient of z in the backward pass.
template <typename Real>
class ResidualMlp final : public ColumnNetwork<Real> {
 public:
  using Matrix = typename ColumnNetwork<Real>::Matrix;

  /// `isa` is set only by tests and benchmarks; the default is the best one.
  explicit ResidualMlp(const ResidualWeights& weights, Isa isa = BestIsa());

  int NumBlocks() const { return static_cast<int>(blocks_.size()); }
  void Forward(Tape<Real>& tape) const override;
  void Backward(const Tape<Real>& tape, const Eigen::Ref<const Matrix>& output_gradient,
                Eigen::Ref<Matrix> input_gradient, Scratch<Real>& scratch) const override;

 private:
  // y = W norm(h) + b. The backward matrix includes the gain, diag(gain) W^T, so that it yields the
  // gradient of (h - mean) / deviation.
  struct NormedLinear {
    AlignedArray<Real> gain, offset, bias;
    PackedMatrix<Real> forward, backward;
  };
  struct Block {
    NormedLinear first;
    PackedMatrix<Real> second, second_backward;
    AlignedArray<Real> second_bias;
  };

  static NormedLinear MakeNormedLinear(const Eigen::VectorXf& gain, const Eigen::VectorXf& offset,
                                       const Eigen::MatrixXf& weight, const Eigen::VectorXf& bias);

  // Levels of a tape: x; the stream before each block and after the last; the silu inputs of all
  // blocks (block by block); the latest normalized or activated values; y.
  static constexpr int kInput = 0;
  int Stream(int block) const { return 1 + block; }
  int Activations() const { return NumBlocks() + 2; }
  int Temporary() const { return NumBlocks() + 3; }
  int Output() const { return NumBlocks() + 4; }

  // Writes norm(h) of level Stream(block) to the temporary, using normalization `block`.
  void NormStream(const NormedLinear& to, int block, Tape<Real>& tape) const;

  const kernels::LayerLoops<Real>* loops_;
  int latent_size_;
  PackedMatrix<Real> input_, input_backward_;
  AlignedArray<Real> input_bias_;
  PackedMatrix<Real> latent_, latent_backward_;  // all blocks, each padded to whole vectors
  std::vector<Block> blocks_;
  NormedLinear output_;
};

extern template class ResidualMlp<float>;
extern template class ResidualMlp<double>;

}  // namespace holdfast::nn
