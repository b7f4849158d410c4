// SPDX-License-Identifier: MIT
#include "generator/nn/mlp.h"

#include <algorithm>
#include <cassert>

namespace holdfast::nn {

template <typename Real>
Mlp<Real>::Mlp(const MlpWeights& weights, Isa isa) : loops_(&LoopsFor<Real>(isa)) {
  assert(!weights.layers.empty());
  for (const LayerWeights& from : weights.layers) {
    // Folds in double and sums the rounded weights, so that a constant input cancels exactly.
    const Eigen::MatrixXd weight = from.weight.cast<double>();
    const Matrix folded = (weight * from.gain.cast<double>().asDiagonal()).cast<Real>();
    const Eigen::VectorXd sums = folded.template cast<double>().rowwise().sum();
    const Eigen::VectorXd bias = from.bias.cast<double>() + weight * from.offset.cast<double>();
    Layer& layer = layers_.emplace_back();
    this->room_.levels.push_back(static_cast<int>(weight.cols()));
    layer.forward = PackedMatrix<Real>(folded);
    layer.backward = PackedMatrix<Real>(folded.transpose());
    layer.row_sums.assign(PaddedRows(layer.forward.Rows()), Real(0));
    layer.bias = layer.row_sums;
    for (int i = 0; i < layer.forward.Rows(); ++i) {
      layer.row_sums[i] = static_cast<Real>(sums[i]);
      layer.bias[i] = static_cast<Real>(bias[i]);
    }
  }
  this->room_.levels.push_back(weights.OutputSize());
  this->room_.num_norms = NumLayers();
  const int widest = *std::max_element(this->room_.levels.begin(), this->room_.levels.end());
  this->room_.gradients = {widest, widest};
}

template <typename Real>
long Mlp<Real>::NumProducts() const {
  long count = 0;
  for (const Layer& layer : layers_) {
    count += static_cast<long>(layer.forward.Rows()) * layer.forward.Inner();
  }
  return count;
}

template <typename Real>
void Mlp<Real>::Forward(Tape<Real>& tape) const {
  const int columns = tape.NumColumns();
  for (int l = 0; l < NumLayers(); ++l) {
    const Layer& layer = layers_[l];
    const Columns<Real> x = tape.Level(l), y = tape.Level(l + 1);
    Real *const mean = tape.Mean(l), *const inverse = tape.InverseDeviation(l);
    loops_->moments(
        {x.data, x.stride, x.rows, columns, static_cast<Real>(kLayerNormEpsilon), mean, inverse});
    layer.forward.Multiply(*loops_, x.data, x.stride, columns, y.data, y.stride, tape.Visited());
    loops_->finish({y.data, y.stride, PaddedRows(y.rows), columns, inverse, mean,
                    layer.row_sums.data(), layer.bias.data(), l + 1 < NumLayers()});
  }
}

template <typename Real>
void Mlp<Real>::Backward(const Tape<Real>& tape, const Eigen::Ref<const Matrix>& output_gradient,
                         Eigen::Ref<Matrix> input_gradient, Scratch<Real>& scratch) const {
  const int columns = static_cast<int>(output_gradient.cols());
  assert(tape.NumColumns() > 0 && columns % tape.NumColumns() == 0);
  assert(columns <= scratch.MaxGradients());
  const int per_column = columns / tape.NumColumns();
  const Real* incoming = output_gradient.data();
  long incoming_stride = output_gradient.outerStride();
  for (int l = NumLayers() - 1; l >= 0; --l) {
    Real* const outgoing = scratch.Gradient(l % 2).data;
    const Columns<const Real> x = tape.Level(l);
    layers_[l].backward.Multiply(*loops_, incoming, incoming_stride, columns, outgoing, x.stride,
                                 scratch.Visited());
    loops_->norm_backward({outgoing, x.stride, x.data, x.stride, x.rows, columns, per_column,
                           tape.Mean(l), tape.InverseDeviation(l), l > 0});
    incoming = outgoing;
    incoming_stride = x.stride;
  }
  for (int j = 0; j < columns; ++j) {
    std::copy_n(incoming + j * incoming_stride, this->InputSize(), input_gradient.col(j).data());
  }
}

template class Mlp<float>;
template class Mlp<double>;

}  // namespace holdfast::nn
