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
/// offset (LayerNorm, biased variance); the last layer of a network has no relu.
struct LayerWeights {
  Eigen::VectorXf gain;    ///< (in)
  Eigen::VectorXf offset;  ///< (in)
  Eigen::MatrixXf weight;  ///< W (out x in)
  Eigen::VectorXf bias;    ///< b (out)
};

inline constexpr double kLayerNormEpsilon = 1e-5;

/// A plain chain of layers without skip connections, as a file holds it.
struct MlpWeights {
  std::vector<LayerWeights> layers;

  int InputSize() const { return static_cast<int>(layers.front().weight.cols()); }
  int OutputSize() const { return static_cast<int>(layers.back().weight.rows()); }
};

/// The widths of WANDR's networks: of `num_interior` + 2 equally spaced values from `input` to
/// `output`, truncated, the interior ones, each rounded up to a power of two.
std::vector<int> TaperedWidths(int input, int output, int num_interior = 13);

/// Gain 1, offset 0, weights and biases uniform in +-1/sqrt(in): PyTorch's start. The same seed
/// gives the same weights everywhere.
MlpWeights RandomMlp(int input, const std::vector<int>& hidden, int output, std::uint64_t seed);

/// Reads `<prefix>.layers.<4k+1>.weight/bias` (LayerNorm) and `<prefix>.layers.<4k+2>.weight/bias`
/// (linear), k = 0, 1, ..: the names of a PyTorch Sequential of Dropout, LayerNorm, Linear and
/// ReLU. `where` names the file in messages. Throws Error for a missing tensor, a wrong shape,
/// layers that do not fit each other, and values that are not finite.
MlpWeights MlpFromTensors(const TensorMap& tensors, const std::string& prefix,
                          const std::string& where);

/// The inverse of MlpFromTensors.
void AddTensors(const MlpWeights& mlp, const std::string& prefix, TensorMap& tensors);

/// A residual network as a file holds it. x (in) begins with z (latent size, may be 0); the stream
/// h has `width` values throughout, and every block sees z again, so that no depth can forget it:
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
    Eigen::MatrixXf latent_weight;  ///< Wz (width x latent), width x 0 where z is not seen
    Eigen::VectorXf first_bias;     ///< b1 (width)
    Eigen::MatrixXf second_weight;  ///< W2 (width x width)
    Eigen::VectorXf second_bias;    ///< b2 (width)
  };

  Eigen::MatrixXf input_weight;  ///< Win (width x in)
  Eigen::VectorXf input_bias;    ///< (width)
  std::vector<Block> blocks;     ///< at least one, all of the same sizes
  Eigen::VectorXf output_gain;   ///< (width)
  Eigen::VectorXf output_offset;
  Eigen::MatrixXf output_weight;  ///< Wout (out x width)
  Eigen::VectorXf output_bias;    ///< (out)

  int InputSize() const { return static_cast<int>(input_weight.cols()); }
  int OutputSize() const { return static_cast<int>(output_weight.rows()); }
  int Width() const { return static_cast<int>(input_weight.rows()); }
  /// Of the z that the blocks see, the first values of x.
  int LatentSize() const { return static_cast<int>(blocks.front().latent_weight.cols()); }
};

/// Gains 1, offsets 0, weights and biases uniform in +-1/sqrt(in): PyTorch's start. The same seed
/// gives the same weights everywhere.
ResidualWeights RandomResidual(int input, int latent, int width, int blocks, int output,
                               std::uint64_t seed);

/// Reads, with .weight and .bias each, `<prefix>.input`, `<prefix>.blocks.<k>.norm/first/second`,
/// `<prefix>.output_norm`, `<prefix>.output`, and `<prefix>.blocks.<k>.latent.weight`, which every
/// block has or none. `where` names the file in messages. Throws Error for a missing tensor, one
/// under the prefix that is none of these, a wrong shape, and values that are not finite.
ResidualWeights ResidualFromTensors(const TensorMap& tensors, const std::string& prefix,
                                    const std::string& where);

/// The inverse of ResidualFromTensors.
void AddTensors(const ResidualWeights& network, const std::string& prefix, TensorMap& tensors);

/// A network of either architecture, as a file holds it.
using AnyWeights = std::variant<MlpWeights, ResidualWeights>;

int InputSize(const AnyWeights& weights);
int OutputSize(const AnyWeights& weights);

/// Whether `name` is a tensor of a network called `prefix`, of either architecture.
bool IsTensorOf(const std::string& prefix, const std::string& name);

/// Reads what MlpFromTensors or ResidualFromTensors does: a chain of layers where there are tensors
/// `<prefix>.layers.*`, a residual network where there are any of its own. Throws Error as they do,
/// and for names of both or of neither.
AnyWeights AnyFromTensors(const TensorMap& tensors, const std::string& prefix,
                          const std::string& where);

/// The inverse of AnyFromTensors.
void AddTensors(const AnyWeights& weights, const std::string& prefix, TensorMap& tensors);

}  // namespace holdfast::nn
