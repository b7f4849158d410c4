// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/nn/column_network.h"
#include "generator/nn/network_weights.h"

namespace holdfast::nn {

/// A residual network (network_weights.h). The contributions of z to all blocks depend only on z
/// and are computed by one product; so is the gradient of z in the backward pass.
template <typename Real>
class ResidualMlp final : public ColumnNetwork<Real> {
 public:
  using Matrix = typename ColumnNetwork<Real>::Matrix;

  /// `isa` is set only by tests and benchmarks; the default is the best one.
  explicit ResidualMlp(const ResidualWeights& weights, Isa isa = BestIsa());

  int NumBlocks() const { return static_cast<int>(blocks_.size()); }
  long NumProducts() const override;
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
