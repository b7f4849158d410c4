// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
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

}  // namespace holdfast::nn
