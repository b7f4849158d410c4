// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/nn/column_network.h"
#include "generator/nn/packed_matrix.h"
#include "generator/nn/tensor.h"

namespace holdfast::imos {

/// BatchNorm with its running statistics: x -> scale x + shift.
struct Affine {
  Eigen::VectorXd scale, shift;
};

/// One residual block in -> width -> out of the published networks, with both BatchNorms folded:
///   y = leaky(s + B leaky(A x + a) + b),  s = leaky(C x + c), or x itself if in = out.
/// Every block has the outer leaky, including output blocks.
struct Block {
  Eigen::MatrixXd first;  ///< A (width x in)
  Eigen::VectorXd first_bias;
  Eigen::MatrixXd second;  ///< B (out x width)
  Eigen::VectorXd second_bias;
  Eigen::MatrixXd skip;  ///< C (out x in)
  Eigen::VectorXd skip_bias;
  bool skip_is_linear = false;  ///< in = out: C x + c is the input, normalized or not
};

/// Reads `<name>.weight`, `.bias`, `.running_mean` and `.running_var` of `size` values. Throws
/// Error as ReadVector does, and for a negative variance.
Affine ReadBatchNorm(const nn::TensorMap& tensors, const std::string& name,
                     const std::string& where, int size);
/// Reads `<name>.fc1`, `.bn1`, `.fc2`, `.bn2`, and `.fc3` if the sizes differ.
Block ReadBlock(const nn::TensorMap& tensors, const std::string& name, const std::string& where,
                int input, int width, int output);
/// Folds a normalization of the first input values into the block.
void FoldInput(const Affine& affine, Block& block);

/// Common structure of all networks here: a block of the input x; a second block of [x | the output
/// of the first]; a linear head. The last two are optional.
struct BlockChain {
  std::vector<Block> blocks;  ///< one or two
  Eigen::MatrixXd head;       ///< (out x in); empty if there is none
  Eigen::VectorXd head_bias;
};

/// A chain prepared to run.
template <typename Real>
class BlockNetwork final : public nn::ColumnNetwork<Real> {
 public:
  explicit BlockNetwork(const BlockChain& chain, Isa isa = BestIsa());

  void Forward(nn::Tape<Real>& tape) const override;

 private:
  // A and C have the same input, so they form one matrix; C's rows start at PaddedRows(width).
  struct PackedBlock {
    int width, output;
    bool skip_is_linear;
    nn::PackedMatrix<Real> first, second;
    nn::AlignedArray<Real> first_bias, second_bias;
  };
  // Levels of a tape: x; with two blocks [x | first output]; the activated [A x | C x] of each
  // block; the output of the last block; the output of the head.
  static constexpr int kInput = 0;
  static constexpr int kJoined = 1;
  bool IsDouble() const { return blocks_.size() == 2; }
  int Inner(int block) const { return (IsDouble() ? 2 : 1) + block; }
  int LastOutput() const { return Inner(static_cast<int>(blocks_.size())); }

  void RunBlock(const PackedBlock& block, const nn::Columns<Real>& x,
                const nn::Columns<Real>& inner, Real* y, long y_stride, int columns) const;

  const kernels::LayerLoops<Real>* loops_;
  std::vector<PackedBlock> blocks_;
  nn::PackedMatrix<Real> head_;
  nn::AlignedArray<Real> head_bias_;
  bool has_head_;
};

extern template class BlockNetwork<float>;
extern template class BlockNetwork<double>;

}  // namespace holdfast::imos
