// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/config.h"
#include "generator/nn/tensor.h"

namespace holdfast::imos {

inline constexpr double kPositionScale = 1e-3;     ///< of the positional encoding
inline constexpr double kAttentionEpsilon = 1e-6;  ///< of the layers' LayerNorm

/// PE (6 x joints): PE[i, p] = sin(p / 10000^(2i/6)), PE[i+1, p] = cos(p / 10000^(2(i+1)/6)) for
/// joint p and i = 0, 2, 4.
Eigen::MatrixXd PositionalEncoding(int joints);

/// Self-attention of the joints of one pose, as published. Tokens are the joints' six numbers x
/// with 1e-3 PE added, X (6 x J). Each layer, q = X for the first:
///   q <- LayerNorm(q + sum_h N_h X softmax(q^T M_h X)^T),
/// over all 6 J numbers with an affine of that shape. Keys and values come from X in every layer.
/// The published products of 6 -> heads x width -> 6 are one 6 x 6 matrix for each head:
/// M_h = Wq_h^T Wk_h / sqrt(width), N_h = Wc_h Wv_h, exact and a third of the work.
template <typename Real>
class Attention {
 public:
  using Matrix6 = Eigen::Matrix<Real, kRotationSize, kRotationSize>;
  /// (6 x J) and (J x J), of at most 22 joints, without memory from the heap.
  using Tokens =
      Eigen::Matrix<Real, kRotationSize, Eigen::Dynamic, 0, kRotationSize, kNumPoseJoints>;
  using Weights =
      Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, 0, kNumPoseJoints, kNumPoseJoints>;

  /// What a run leaves behind for running backwards. Make one with MakeTape().
  struct Tape {
    struct Layer {
      Tokens query, normed;
      std::vector<Weights> attention;  // (queries x keys) of each head
      Real inverse_deviation = 0;
    };
    Tokens tokens;
    std::vector<Layer> layers;
  };

  /// Reads body.attention_model.* ; throws Error as nn::ReadMatrix does.
  Attention(const nn::TensorMap& tensors, const Config& config, const std::string& where);

  int NumJoints() const { return static_cast<int>(position_.cols()); }
  Tape MakeTape() const;

  /// `pose` and `out` hold 6 J numbers, joint by joint.
  void Forward(const Real* pose, Real* out, Tape& tape) const;
  /// Adds the vector-Jacobian product at what Forward last ran on `tape` to `pose_bar`.
  void Backward(const Tape& tape, const Real* out_bar, Real* pose_bar) const;

 private:
  struct Layer {
    std::vector<Matrix6> scores, values;  // M_h, N_h
    Tokens gain, offset;
  };

  Tokens position_;
  std::vector<Layer> layers_;
};

extern template class Attention<float>;
extern template class Attention<double>;

}  // namespace holdfast::imos
