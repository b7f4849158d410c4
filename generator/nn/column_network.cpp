// SPDX-License-Identifier: MIT
#include "generator/nn/column_network.h"

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

namespace {

template <typename Real>
AlignedArray<Real> Padded(const Eigen::VectorXf& values) {
  AlignedArray<Real> padded(PaddedRows(static_cast<int>(values.size())), Real(0));
  std::copy(values.begin(), values.end(), padded.begin());
  return padded;
}

}  // namespace

template <typename Real>
typename ResidualMlp<Real>::NormedLinear ResidualMlp<Real>::MakeNormedLinear(
    const Eigen::VectorXf& gain, const Eigen::VectorXf& offset, const Eigen::MatrixXf& weight,
    const Eigen::VectorXf& bias) {
  const Matrix scaled = gain.cast<Real>().asDiagonal() * weight.transpose().cast<Real>();
  return {Padded<Real>(gain), Padded<Real>(offset), Padded<Real>(bias),
          PackedMatrix<Real>(weight.cast<Real>()), PackedMatrix<Real>(scaled)};
}

template <typename Real>
ResidualMlp<Real>::ResidualMlp(const ResidualWeights& weights, Isa isa)
    : loops_(&LoopsFor<Real>(isa)),
      latent_size_(weights.LatentSize()),
      input_(weights.input_weight.cast<Real>()),
      input_backward_(weights.input_weight.transpose().cast<Real>()),
      input_bias_(Padded<Real>(weights.input_bias)),
      output_(MakeNormedLinear(weights.output_gain, weights.output_offset, weights.output_weight,
                               weights.output_bias)) {
  assert(!weights.blocks.empty());
  const int width = weights.Width(), padded = PaddedRows(width);
  const int all = padded * static_cast<int>(weights.blocks.size());
  Matrix latent = Matrix::Zero(all, latent_size_);
  for (const ResidualWeights::Block& from : weights.blocks) {
    const Matrix second = from.second_weight.cast<Real>();
    latent.middleRows(padded * NumBlocks(), width) = from.latent_weight.cast<Real>();
    blocks_.push_back({MakeNormedLinear(from.gain, from.offset, from.first_weight, from.first_bias),
                       PackedMatrix<Real>(second), PackedMatrix<Real>(second.transpose()),
                       Padded<Real>(from.second_bias)});
  }
  latent_ = PackedMatrix<Real>(latent);
  latent_backward_ = PackedMatrix<Real>(latent.transpose());

  this->room_.levels.assign(NumBlocks() + 5, width);
  this->room_.levels[kInput] = weights.InputSize();
  this->room_.levels[Activations()] = all;
  this->room_.levels[Output()] = weights.OutputSize();
  this->room_.num_norms = NumBlocks() + 1;
  this->room_.gradients = {width, width, all, weights.InputSize(), latent_size_};
}

template <typename Real>
void ResidualMlp<Real>::NormStream(const NormedLinear& to, int block, Tape<Real>& tape) const {
  const Columns<Real> h = tape.Level(Stream(block)), normed = tape.Level(Temporary());
  Real *const mean = tape.Mean(block), *const inverse = tape.InverseDeviation(block);
  const int columns = tape.NumColumns();
  loops_->moments(
      {h.data, h.stride, h.rows, columns, static_cast<Real>(kLayerNormEpsilon), mean, inverse});
  loops_->normalize({h.data, h.stride, PaddedRows(h.rows), columns, mean, inverse, to.gain.data(),
                     to.offset.data(), normed.data, normed.stride});
}

template <typename Real>
void ResidualMlp<Real>::Forward(Tape<Real>& tape) const {
  const int columns = tape.NumColumns();
  const auto multiply = [&](const PackedMatrix<Real>& a, const Columns<Real>& x, Real* y,
                            long y_stride) {
    a.Multiply(*loops_, x.data, x.stride, columns, y, y_stride, nullptr);
  };
  const Columns<Real> x = tape.Level(kInput), all = tape.Level(Activations());
  const Columns<Real> temporary = tape.Level(Temporary()), y = tape.Level(Output());
  Columns<Real> h = tape.Level(Stream(0));
  const int rows = PaddedRows(h.rows);
  multiply(input_, x, h.data, h.stride);
  loops_->leaky({h.data, h.stride, rows, columns, input_bias_.data(), nullptr, 0, Real(1)});
  multiply(latent_, x, all.data, all.stride);
  for (int k = 0; k < NumBlocks(); ++k) {
    const Block& block = blocks_[k];
    // The next level of the stream holds the first product until the second product replaces it.
    const Columns<Real> next = tape.Level(Stream(k + 1));
    Real* const activation = all.data + static_cast<long>(rows) * k;
    NormStream(block.first, k, tape);
    multiply(block.first.forward, temporary, next.data, next.stride);
    loops_->leaky({activation, all.stride, rows, columns, block.first.bias.data(), next.data,
                   next.stride, Real(1)});
    loops_->silu({activation, all.stride, rows, columns, temporary.data, temporary.stride});
    multiply(block.second, temporary, next.data, next.stride);
    loops_->leaky({next.data, next.stride, rows, columns, block.second_bias.data(), h.data,
                   h.stride, Real(1)});
    h = next;
  }
  NormStream(output_, NumBlocks(), tape);
  multiply(output_.forward, temporary, y.data, y.stride);
  loops_->leaky(
      {y.data, y.stride, PaddedRows(y.rows), columns, output_.bias.data(), nullptr, 0, Real(1)});
}

template <typename Real>
void ResidualMlp<Real>::Backward(const Tape<Real>& tape,
                                 const Eigen::Ref<const Matrix>& output_gradient,
                                 Eigen::Ref<Matrix> input_gradient, Scratch<Real>& scratch) const {
  const int columns = static_cast<int>(output_gradient.cols());
  assert(tape.NumColumns() > 0 && columns % tape.NumColumns() == 0);
  assert(columns <= scratch.MaxGradients());
  const int per_column = columns / tape.NumColumns();
  const Columns<Real> stream = scratch.Gradient(0), branch = scratch.Gradient(1);
  const Columns<Real> all = scratch.Gradient(2), input = scratch.Gradient(3);
  const Columns<Real> latent = scratch.Gradient(4);
  const Columns<const Real> activations = tape.Level(Activations());
  const int rows = PaddedRows(stream.rows);
  const auto multiply = [&](const PackedMatrix<Real>& a, const Real* x, long x_stride,
                            const Columns<Real>& y) {
    a.Multiply(*loops_, x, x_stride, columns, y.data, y.stride, nullptr);
  };
  const auto norm_backward = [&](const Columns<Real>& gradient, int block) {
    const Columns<const Real> h = tape.Level(Stream(block));
    loops_->norm_backward({gradient.data, gradient.stride, h.data, h.stride, h.rows, columns,
                           per_column, tape.Mean(block), tape.InverseDeviation(block), false});
  };

  multiply(output_.backward, output_gradient.data(), output_gradient.outerStride(), stream);
  norm_backward(stream, NumBlocks());
  for (int k = NumBlocks() - 1; k >= 0; --k) {
    const long begin = static_cast<long>(rows) * k;
    const Columns<Real> activation{all.data + begin, all.stride, stream.rows};
    multiply(blocks_[k].second_backward, stream.data, stream.stride, activation);
    loops_->silu_backward({activation.data, all.stride, activations.data + begin,
                           activations.stride, rows, columns, per_column});
    multiply(blocks_[k].first.backward, activation.data, all.stride, branch);
    norm_backward(branch, k);
    loops_->leaky(
        {stream.data, stream.stride, rows, columns, nullptr, branch.data, branch.stride, Real(1)});
  }
  multiply(input_backward_, stream.data, stream.stride, input);
  multiply(latent_backward_, all.data, all.stride, latent);
  for (int j = 0; j < columns; ++j) {
    const Real* const of_x = input.data + j * input.stride;
    const Real* const of_z = latent.data + j * latent.stride;
    Real* const out = input_gradient.col(j).data();
    std::copy_n(of_x, this->InputSize(), out);
    for (int i = 0; i < latent_size_; ++i) out[i] += of_z[i];
  }
}

template class ResidualMlp<float>;
template class ResidualMlp<double>;

namespace {

// Upper bound on the inner dimension of any product.
int Widest(const std::vector<int>& rows) { return *std::max_element(rows.begin(), rows.end()); }

}  // namespace

template <typename Real>
std::unique_ptr<const ColumnNetwork<Real>> MakeNetwork(const AnyWeights& weights, Isa isa) {
  if (const auto* chain = std::get_if<MlpWeights>(&weights)) {
    return std::make_unique<const Mlp<Real>>(*chain, isa);
  }
  return std::make_unique<const ResidualMlp<Real>>(std::get<ResidualWeights>(weights), isa);
}

template <typename Real>
Tape<Real>::Tape(const ColumnNetwork<Real>& network, int max_columns)
    : rows_(network.RoomNeeded().levels), max_columns_(max_columns), num_columns_(max_columns) {
  std::size_t size = 0;
  for (const int rows : rows_) {
    begin_.push_back(size);
    size += static_cast<std::size_t>(PaddedRows(rows)) * max_columns;
  }
  values_.assign(size, Real(0));
  mean_.assign(At(network.RoomNeeded().num_norms), Real(0));
  inverse_deviation_ = mean_;
  visited_.resize(Widest(rows_));
}

template <typename Real>
void Tape<Real>::Resize(int num_columns) {
  assert(num_columns >= 0 && num_columns <= max_columns_);
  num_columns_ = num_columns;
}

template <typename Real>
Scratch<Real>::Scratch(const ColumnNetwork<Real>& network, int max_gradients)
    : rows_(network.RoomNeeded().gradients), max_gradients_(max_gradients) {
  for (const int rows : rows_) {
    gradients_.emplace_back(static_cast<std::size_t>(PaddedRows(rows)) * max_gradients, Real(0));
  }
  visited_.resize(std::max(Widest(rows_), network.OutputSize()));
}

template class Tape<float>;
template class Tape<double>;
template class Scratch<float>;
template class Scratch<double>;
template std::unique_ptr<const ColumnNetwork<float>> MakeNetwork(const AnyWeights&, Isa);
template std::unique_ptr<const ColumnNetwork<double>> MakeNetwork(const AnyWeights&, Isa);

}  // namespace holdfast::nn
