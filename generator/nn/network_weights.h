// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "generator/nn/tensor.h"

namespace holdfast::nn {

/// One layer: y = relu(W norm(x) + b), norm(x) = gain * (x - mean(x)) / sqrt(var(x) + 1e-5) +
/// offset (LayerNorm, biased variance). The last layer of a network has no relu.
struct LayerWeights {
  Eigen::VectorXf gain;    ///< (in)
  Eigen::VectorXf offset;  ///< (in)
  Eigen::MatrixXf weight;  ///< W (out x in)
  Eigen::VectorXf bias;    ///< b (out)
};

inline constexpr double kLayerNormEpsilon = 1e-5;

/// Weights of a feed-forward chain of layers without skip connections, as stored in a file.
struct MlpWeights {
  std::vector<LayerWeights> layers;

  int InputSize() const { return static_cast<int>(layers.front().weight.cols()); }
  int OutputSize() const { return static_cast<int>(layers.back().weight.rows()); }
};

/// Widths of the hidden layers of WANDR's networks: the interior ones of `num_interior` + 2 equally
/// spaced values from `input` to `output`, truncated, then rounded up to a power of two.
std::vector<int> TaperedWidths(int input, int output, int num_interior = 13);

/// Initializes as PyTorch does: gain 1, offset 0, weights and biases uniform in +-1/sqrt(in). The
/// same seed gives the same weights on every platform.
MlpWeights RandomMlp(int input, const std::vector<int>& hidden, int output, std::uint64_t seed);

/// Reads `<prefix>.layers.<4k+1>.weight/bias` (LayerNorm) and `<prefix>.layers.<4k+2>.weight/bias`
/// (linear), k = 0, 1, ..: the names in a PyTorch Sequential of Dropout, LayerNorm, Linear and
/// ReLU. `where` names the file in messages. Throws Error for a missing tensor, a wrong shape,
/// incompatible layer sizes, and non-finite values.
MlpWeights MlpFromTensors(const TensorMap& tensors, const std::string& prefix,
                          const std::string& where);

/// Inverse of MlpFromTensors.
void AddTensors(const MlpWeights& mlp, const std::string& prefix, TensorMap& tensors);

/// Weights of a residual network as stored in a file. x (in) begins with the latent z, which may be
/// empty; the stream h has `width` values. Every block receives z, so that depth does not lose it:
///   h = Win x + bin
///   for each block:  h = h + W2 silu(W1 norm(h) + Wz z + b1) + b2
///   y = Wout norm(h) + bout
/// with norm(h) = gain * (h - mean(h)) / sqrt(var(h) + kLayerNormEpsilon) + offset (biased
/// variance) and silu(a) = a / (1 + exp(-a)).
struct ResidualWeights {
  struct Block {
    Eigen::VectorXf gain;           ///< (width)
    Eigen::VectorXf offset;         ///< (width)
    Eigen::MatrixXf first_weight;   ///< W1 (width x width)
    Eigen::MatrixXf latent_weight;  ///< Wz (width x latent), width x 0 without z
    Eigen::VectorXf first_bias;     ///< b1 (width)
    Eigen::MatrixXf second_weight;  ///< W2 (width x width)
    Eigen::VectorXf second_bias;    ///< b2 (width)
  };

  Eigen::MatrixXf input_weight;  ///< Win (width x in)
  Eigen::VectorXf input_bias;    ///< (width)
  std::vector<Block> blocks;     ///< at least one, all of the same size
  Eigen::VectorXf output_gain;   ///< (width)
  Eigen::VectorXf output_offset;
  Eigen::MatrixXf output_weight;  ///< Wout (out x width)
  Eigen::VectorXf output_bias;    ///< (out)

  int InputSize() const { return static_cast<int>(input_weight.cols()); }
  int OutputSize() const { return static_cast<int>(output_weight.rows()); }
  int Width() const { return static_cast<int>(input_weight.rows()); }
  /// Size of z, which is the first part of x.
  int LatentSize() const { return static_cast<int>(blocks.front().latent_weight.cols()); }
};

/// Initializes as PyTorch does: gains 1, offsets 0, weights and biases uniform in +-1/sqrt(in). The
/// same seed gives the same weights on every platform.
ResidualWeights RandomResidual(int input, int latent, int width, int blocks, int output,
                               std::uint64_t seed);

/// Reads the .weight and .bias of `<prefix>.input`, `<prefix>.blocks.<k>.norm/first/second`,
/// `<prefix>.output_norm` and `<prefix>.output`, and `<prefix>.blocks.<k>.latent.weight`, which
/// either all blocks have or none. `where` names the file in messages. Throws Error for a missing
/// tensor, an unknown tensor under the prefix, a wrong shape, and non-finite values.
ResidualWeights ResidualFromTensors(const TensorMap& tensors, const std::string& prefix,
                                    const std::string& where);

/// Inverse of ResidualFromTensors.
void AddTensors(const ResidualWeights& network, const std::string& prefix, TensorMap& tensors);

/// Weights of a network of either architecture, as stored in a file.
using AnyWeights = std::variant<MlpWeights, ResidualWeights>;

int InputSize(const AnyWeights& weights);
int OutputSize(const AnyWeights& weights);

/// Returns whether `name` is a tensor of a network called `prefix`, of either architecture.
bool IsTensorOf(const std::string& prefix, const std::string& name);

/// Reads a chain of layers if there are tensors `<prefix>.layers.*` (MlpFromTensors), or a residual
/// network if there are any of its tensors (ResidualFromTensors). Throws Error as these do, and if
/// there are tensors of both or of neither.
AnyWeights AnyFromTensors(const TensorMap& tensors, const std::string& prefix,
                          const std::string& where);

/// Inverse of AnyFromTensors.
void AddTensors(const AnyWeights& weights, const std::string& prefix, TensorMap& tensors);

}  // namespace holdfast::nn
