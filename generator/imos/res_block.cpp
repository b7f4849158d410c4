// SPDX-License-Identifier: MIT
#include "generator/imos/res_block.h"

#include <algorithm>
#include <cassert>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast::imos {
namespace {

using nn::PaddedRows;

constexpr double kLeakySlope = 0.2;
constexpr double kBatchNormEpsilon = 1e-5;

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
BlockNetwork<Real>::BlockNetwork(const BlockChain& chain, Isa isa)
    : loops_(&nn::LoopsFor<Real>(isa)), has_head_(chain.head.size() > 0) {
  assert(chain.blocks.size() == 1 || chain.blocks.size() == 2);
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
    block.first = nn::PackedMatrix<Real>(both.cast<Real>());
    block.second = nn::PackedMatrix<Real>(from.second.cast<Real>());
    block.first_bias = Padded<Real>(both_bias);
    block.second_bias = Padded<Real>(from.second_bias);
  }
  if (has_head_) {
    head_ = nn::PackedMatrix<Real>(chain.head.cast<Real>());
    head_bias_ = Padded<Real>(chain.head_bias);
  }

  const int input = blocks_.front().first.Inner();
  std::vector<int>& levels = this->room_.levels;
  levels = {input};
  // The first block's output is written in whole vectors after x.
  if (IsDouble()) levels.push_back(input + PaddedRows(blocks_.front().output));
  for (const PackedBlock& block : blocks_) {
    levels.push_back(PaddedRows(block.width) + block.output);
  }
  levels.push_back(blocks_.back().output);
  if (has_head_) levels.push_back(head_.Rows());
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
  loops_->leaky(
      {y.data, y.stride, PaddedRows(y.rows), columns, head_bias_.data(), nullptr, 0, Real(1)});
}

template class BlockNetwork<float>;
template class BlockNetwork<double>;

}  // namespace holdfast::imos
