// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Core>

#include "generator/nn/column_network.h"
#include "generator/nn/network_weights.h"

namespace holdfast::nn {

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
  long NumProducts() const override;
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

}  // namespace holdfast::nn
