// SPDX-License-Identifier: MIT
#include "generator/imos/res_block.h"

#include <algorithm>
#include <cassert>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast::imos {
namespace {

using nn::PaddedRows;

template <typename Real>
nn::AlignedArray<Real> Padded(const Eigen::VectorXd& values) {
  nn::AlignedArray<Real> padded(PaddedRows(static_cast<int>(values.size())), Real(0));
  std::ranges::transform(values, padded.begin(), [](double v) { return static_cast<Real>(v); });
  return padded;
}

struct Linear {
  Eigen::MatrixXd weight;
  Eigen::VectorXd bias;
};

Linear ReadLinear(const nn::TensorMap& tensors, const std::string& name, const std::string& where,
                  int input, int output) {
  return {nn::ReadMatrix(tensors, name + ".weight", where, output, input).cast<double>(),
          nn::ReadVector(tensors, name + ".bias", where, output).cast<double>()};
}

// Normalizes the output of a linear layer.
Linear Normed(const Affine& affine, Linear linear) {
  linear.weight = affine.scale.asDiagonal() * linear.weight;
  linear.bias = affine.scale.cwiseProduct(linear.bias) + affine.shift;
  return linear;
}

}  // namespace

Affine ReadBatchNorm(const nn::TensorMap& tensors, const std::string& name,
                     const std::string& where, int size) {
  const auto read = [&](const char* part) -> Eigen::VectorXd {
    return nn::ReadVector(tensors, name + part, where, size).cast<double>();
  };
  const Eigen::VectorXd variance = read(".running_var");
  if (variance.minCoeff() < 0.0) {
    throw Error(where, fmt::format("'{}.running_var' holds negative variances", name),
                "Give a file of a network of this kind");
  }
  const Eigen::VectorXd scale =
      read(".weight").array() / (variance.array() + kBatchNormEpsilon).sqrt();
  return {scale, read(".bias") - scale.cwiseProduct(read(".running_mean"))};
}

Block ReadBlock(const nn::TensorMap& tensors, const std::string& name, const std::string& where,
                int input, int width, int output) {
  const Linear first = Normed(ReadBatchNorm(tensors, name + ".bn1", where, width),
                              ReadLinear(tensors, name + ".fc1", where, input, width));
  const Linear second = Normed(ReadBatchNorm(tensors, name + ".bn2", where, output),
                               ReadLinear(tensors, name + ".fc2", where, width, output));
  Block block{first.weight, first.bias, second.weight, second.bias, {}, {}, input == output};
  if (block.skip_is_linear) {
    block.skip = Eigen::MatrixXd::Identity(output, input);
    block.skip_bias = Eigen::VectorXd::Zero(output);
  } else {
    Linear skip = ReadLinear(tensors, name + ".fc3", where, input, output);
    block.skip = std::move(skip.weight);
    block.skip_bias = std::move(skip.bias);
  }
  return block;
}

void FoldInput(const Affine& affine, Block& block) {
  const Eigen::Index size = affine.scale.size();
  const auto fold = [&](Eigen::MatrixXd& weight, Eigen::VectorXd& bias) {
    bias += weight.leftCols(size) * affine.shift;
    weight.leftCols(size) = (weight.leftCols(size) * affine.scale.asDiagonal()).eval();
  };
  fold(block.first, block.first_bias);
  fold(block.skip, block.skip_bias);
}

template <typename Real>
BlockNetwork<Real>::BlockNetwork(const BlockChain& chain, bool differentiable, Isa isa)
    : loops_(&nn::LoopsFor<Real>(isa)),
      differentiable_(differentiable),
      has_head_(chain.head.size() > 0) {
  assert(chain.blocks.size() == 1 || chain.blocks.size() == 2);
  const auto pack = [&](const Eigen::MatrixXd& a, nn::PackedMatrix<Real>& forward,
                        nn::PackedMatrix<Real>& backward) {
    forward = nn::PackedMatrix<Real>(a.cast<Real>());
    if (differentiable) backward = nn::PackedMatrix<Real>(a.transpose().cast<Real>());
  };
  for (const Block& from : chain.blocks) {
    PackedBlock& block = blocks_.emplace_back();
    block.width = static_cast<int>(from.first.rows());
    block.output = static_cast<int>(from.second.rows());
    block.skip_is_linear = from.skip_is_linear;
    const int begin = PaddedRows(block.width);
    Eigen::MatrixXd both = Eigen::MatrixXd::Zero(begin + block.output, from.first.cols());
    both.topRows(block.width) = from.first;
    both.bottomRows(block.output) = from.skip;
    Eigen::VectorXd both_bias = Eigen::VectorXd::Zero(begin + block.output);
    both_bias.head(block.width) = from.first_bias;
    both_bias.tail(block.output) = from.skip_bias;
    pack(both, block.first, block.first_backward);
    pack(from.second, block.second, block.second_backward);
    block.first_bias = Padded<Real>(both_bias);
    block.second_bias = Padded<Real>(from.second_bias);
  }
  if (has_head_) {
    pack(chain.head, head_, head_backward_);
    head_bias_ = Padded<Real>(chain.head_bias);
  }

  const int input = blocks_.front().first.Inner();
  std::vector<int>& levels = this->room_.levels;
  levels = {input};
  // The first block's output is written in whole vectors after x.
  if (IsDouble()) levels.push_back(input + PaddedRows(blocks_.front().output));
  int widest_inner = 0, widest_input = 0, widest_output = 0;
  for (const PackedBlock& block : blocks_) {
    levels.push_back(PaddedRows(block.width) + block.output);
    widest_inner = std::max(widest_inner, levels.back());
    widest_input = std::max(widest_input, block.first.Inner());
    widest_output = std::max(widest_output, block.output);
  }
  levels.push_back(blocks_.back().output);
  if (has_head_) levels.push_back(head_.Rows());
  if (differentiable) {
    this->room_.gradients = {widest_output, widest_inner, widest_input, input};
  }
}

template <typename Real>
long BlockNetwork<Real>::NumProducts() const {
  long count = static_cast<long>(head_.Rows()) * head_.Inner();
  for (const PackedBlock& block : blocks_) {
    const long skip = block.skip_is_linear ? 0 : block.output;
    count +=
        (block.width + skip) * block.first.Inner() + static_cast<long>(block.output) * block.width;
  }
  return count;
}

template <typename Real>
void BlockNetwork<Real>::RunBlock(const PackedBlock& block, const nn::Columns<Real>& x,
                                  const nn::Columns<Real>& inner, Real* y, long y_stride,
                                  int columns) const {
  const Real slope = static_cast<Real>(kLeakySlope);
  const int begin = PaddedRows(block.width), rows = PaddedRows(block.output);
  Real* const skip = inner.data + begin;
  block.first.Multiply(*loops_, x.data, x.stride, columns, inner.data, inner.stride, nullptr);
  loops_->leaky(
      {inner.data, inner.stride, begin, columns, block.first_bias.data(), nullptr, 0, slope});
  // A slope of 1 disables the rectifier.
  loops_->leaky({skip, inner.stride, rows, columns, block.first_bias.data() + begin, nullptr, 0,
                 block.skip_is_linear ? Real(1) : slope});
  block.second.Multiply(*loops_, inner.data, inner.stride, columns, y, y_stride, nullptr);
  loops_->leaky({y, y_stride, rows, columns, block.second_bias.data(), skip, inner.stride, slope});
}

template <typename Real>
void BlockNetwork<Real>::Forward(nn::Tape<Real>& tape) const {
  const int columns = tape.NumColumns();
  const nn::Columns<Real> x = tape.Level(kInput), last = tape.Level(LastOutput());
  if (IsDouble()) {
    const nn::Columns<Real> joined = tape.Level(kJoined);
    for (int j = 0; j < columns; ++j) {
      std::copy_n(x.data + j * x.stride, x.rows, joined.data + j * joined.stride);
    }
    RunBlock(blocks_[0], x, tape.Level(Inner(0)), joined.data + x.rows, joined.stride, columns);
    RunBlock(blocks_[1], joined, tape.Level(Inner(1)), last.data, last.stride, columns);
  } else {
    RunBlock(blocks_[0], x, tape.Level(Inner(0)), last.data, last.stride, columns);
  }
  if (!has_head_) return;
  const nn::Columns<Real> y = tape.Level(LastOutput() + 1);
  head_.Multiply(*loops_, last.data, last.stride, columns, y.data, y.stride, nullptr);
  loops_->sum({y.data, y.stride, PaddedRows(y.rows), columns, head_bias_.data(), nullptr, 0});
}

template <typename Real>
void BlockNetwork<Real>::RunBlockBackward(const PackedBlock& block,
                                          const nn::Columns<const Real>& inner, const Real* y,
                                          long y_stride, const nn::Columns<Real>& gradient,
                                          const nn::Columns<Real>& inner_gradient,
                                          const nn::Columns<Real>& out, int columns,
                                          int per_column) const {
  const Real slope = static_cast<Real>(kLeakySlope);
  const int begin = PaddedRows(block.width), rows = PaddedRows(block.output);
  Real* const skip = inner_gradient.data + begin;
  loops_->leaky_backward(
      {gradient.data, gradient.stride, y, y_stride, rows, columns, per_column, slope});
  block.second_backward.Multiply(*loops_, gradient.data, gradient.stride, columns,
                                 inner_gradient.data, inner_gradient.stride, nullptr);
  loops_->leaky_backward({inner_gradient.data, inner_gradient.stride, inner.data, inner.stride,
                          begin, columns, per_column, slope});
  for (int j = 0; j < columns; ++j) {
    std::copy_n(gradient.data + j * gradient.stride, rows, skip + j * inner_gradient.stride);
  }
  loops_->leaky_backward({skip, inner_gradient.stride, inner.data + begin, inner.stride, rows,
                          columns, per_column, block.skip_is_linear ? Real(1) : slope});
  block.first_backward.Multiply(*loops_, inner_gradient.data, inner_gradient.stride, columns,
                                out.data, out.stride, nullptr);
}

template <typename Real>
void BlockNetwork<Real>::Backward(const nn::Tape<Real>& tape,
                                  const Eigen::Ref<const Matrix>& output_gradient,
                                  Eigen::Ref<Matrix> input_gradient,
                                  nn::Scratch<Real>& scratch) const {
  assert(differentiable_);
  const int columns = static_cast<int>(output_gradient.cols());
  assert(tape.NumColumns() > 0 && columns % tape.NumColumns() == 0);
  assert(columns <= scratch.MaxGradients());
  const int per_column = columns / tape.NumColumns();
  const nn::Columns<Real> gradient = scratch.Gradient(0), inner = scratch.Gradient(1);
  const nn::Columns<Real> joined = scratch.Gradient(2), first = scratch.Gradient(3);
  const int last = static_cast<int>(blocks_.size()) - 1;
  if (has_head_) {
    head_backward_.Multiply(*loops_, output_gradient.data(), output_gradient.outerStride(), columns,
                            gradient.data, gradient.stride, nullptr);
  } else {
    for (int j = 0; j < columns; ++j) {
      std::copy_n(output_gradient.col(j).data(), this->OutputSize(),
                  gradient.data + j * gradient.stride);
    }
  }
  const nn::Columns<const Real> y = tape.Level(LastOutput());
  const nn::Columns<Real>& of_last = IsDouble() ? joined : first;
  RunBlockBackward(blocks_[last], tape.Level(Inner(last)), y.data, y.stride, gradient, inner,
                   of_last, columns, per_column);
  const int input = this->InputSize();
  if (IsDouble()) {
    for (int j = 0; j < columns; ++j) {
      std::copy_n(joined.data + j * joined.stride + input, blocks_[0].output,
                  gradient.data + j * gradient.stride);
    }
    const nn::Columns<const Real> values = tape.Level(kJoined);
    RunBlockBackward(blocks_[0], tape.Level(Inner(0)), values.data + input, values.stride, gradient,
                     inner, first, columns, per_column);
  }
  for (int j = 0; j < columns; ++j) {
    const Real* const own = first.data + j * first.stride;
    Real* const out = input_gradient.col(j).data();
    std::copy_n(own, input, out);
    if (!IsDouble()) continue;
    const Real* const through_second = joined.data + j * joined.stride;
    for (int i = 0; i < input; ++i) out[i] += through_second[i];
  }
}

template class BlockNetwork<float>;
template class BlockNetwork<double>;

}  // namespace holdfast::imos
