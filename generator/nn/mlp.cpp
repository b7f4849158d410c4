// SPDX-License-Identifier: MIT
#include "generator/nn/mlp.h"

#include <algorithm>
#include <cassert>

namespace holdfast::nn {

template <typename Real>
Mlp<Real>::Mlp(const MlpWeights& weights, Isa isa) : loops_(&LoopsFor<Real>(isa)) {
  assert(!weights.layers.empty());
  for (const LayerWeights& from : weights.layers) {
    // Folded in double, and summed as rounded: a constant input must give exactly its share.
    const Eigen::MatrixXd weight = from.weight.cast<double>();
    const Matrix folded = (weight * from.gain.cast<double>().asDiagonal()).cast<Real>();
    const Eigen::VectorXd sums = folded.template cast<double>().rowwise().sum();
    const Eigen::VectorXd bias = from.bias.cast<double>() + weight * from.offset.cast<double>();
    Layer& layer = layers_.emplace_back();
    layer.forward = PackedMatrix<Real>(folded);
    layer.backward = PackedMatrix<Real>(folded.transpose());
    layer.row_sums.assign(PaddedRows(layer.forward.Rows()), Real(0));
    layer.bias = layer.row_sums;
    for (int i = 0; i < layer.forward.Rows(); ++i) {
      layer.row_sums[i] = static_cast<Real>(sums[i]);
      layer.bias[i] = static_cast<Real>(bias[i]);
    }
  }
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
void Mlp<Real>::Forward(MlpTape<Real>& tape) const {
  const int columns = tape.num_columns_;
  for (int l = 0; l < NumLayers(); ++l) {
    const Layer& layer = layers_[l];
    const Real* const x = tape.values_.data() + tape.begin_[l];
    Real* const y = tape.values_.data() + tape.begin_[l + 1];
    const int x_stride = PaddedRows(tape.rows_[l]), y_stride = PaddedRows(tape.rows_[l + 1]);
    Real* const mean = tape.mean_.data() + static_cast<std::size_t>(l) * tape.max_columns_;
    Real* const inverse =
        tape.inverse_deviation_.data() + static_cast<std::size_t>(l) * tape.max_columns_;
    loops_->moments(
        {x, x_stride, tape.rows_[l], columns, static_cast<Real>(kLayerNormEpsilon), mean, inverse});
    layer.forward.Multiply(*loops_, x, x_stride, columns, y, y_stride, tape.visited_.data());
    loops_->finish({y, y_stride, y_stride, columns, inverse, mean, layer.row_sums.data(),
                    layer.bias.data(), l + 1 < NumLayers()});
  }
}

template <typename Real>
void Mlp<Real>::Backward(const MlpTape<Real>& tape, const Eigen::Ref<const Matrix>& output_gradient,
                         Eigen::Ref<Matrix> input_gradient, MlpScratch<Real>& scratch) const {
  const int columns = static_cast<int>(output_gradient.cols());
  assert(tape.num_columns_ > 0 && columns % tape.num_columns_ == 0);
  assert(columns <= scratch.max_gradients_);
  const int per_column = columns / tape.num_columns_;
  const Real* incoming = output_gradient.data();
  long incoming_stride = output_gradient.outerStride();
  for (int l = NumLayers() - 1; l >= 0; --l) {
    Real* const outgoing = scratch.gradient_[l % 2].data();
    const int stride = PaddedRows(tape.rows_[l]);
    layers_[l].backward.Multiply(*loops_, incoming, incoming_stride, columns, outgoing, stride,
                                 scratch.visited_.data());
    const std::size_t first = static_cast<std::size_t>(l) * tape.max_columns_;
    loops_->norm_backward({outgoing, stride, tape.values_.data() + tape.begin_[l], stride,
                           tape.rows_[l], columns, per_column, tape.mean_.data() + first,
                           tape.inverse_deviation_.data() + first, l > 0});
    incoming = outgoing;
    incoming_stride = stride;
  }
  for (int j = 0; j < columns; ++j) {
    std::copy_n(incoming + j * incoming_stride, InputSize(), input_gradient.col(j).data());
  }
}

template <typename Real>
MlpTape<Real>::MlpTape(const Mlp<Real>& mlp, int max_columns)
    : max_columns_(max_columns), num_columns_(max_columns) {
  for (const auto& layer : mlp.layers_) rows_.push_back(layer.forward.Inner());
  rows_.push_back(mlp.OutputSize());
  std::size_t size = 0;
  for (const int rows : rows_) {
    begin_.push_back(size);
    size += static_cast<std::size_t>(PaddedRows(rows)) * max_columns;
  }
  values_.assign(size, Real(0));
  mean_.assign(mlp.layers_.size() * max_columns, Real(0));
  inverse_deviation_ = mean_;
  visited_.resize(*std::max_element(rows_.begin(), rows_.end()));
}

template <typename Real>
MlpScratch<Real>::MlpScratch(const Mlp<Real>& mlp, int max_gradients)
    : max_gradients_(max_gradients) {
  int widest = mlp.OutputSize();
  for (const auto& layer : mlp.layers_) widest = std::max(widest, layer.forward.Inner());
  for (auto& gradient : gradient_) {
    gradient.assign(static_cast<std::size_t>(PaddedRows(widest)) * max_gradients, Real(0));
  }
  visited_.resize(widest);
}

template <typename Real>
void MlpTape<Real>::Resize(int num_columns) {
  assert(num_columns >= 0 && num_columns <= max_columns_);
  num_columns_ = num_columns;
}

template class Mlp<float>;
template class Mlp<double>;
template class MlpTape<float>;
template class MlpTape<double>;
template class MlpScratch<float>;
template class MlpScratch<double>;

}  // namespace holdfast::nn
