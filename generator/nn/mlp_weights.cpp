// SPDX-License-Identifier: MIT
#include "generator/nn/mlp_weights.h"

#include <bit>
#include <cmath>

#include <fmt/format.h>

#include "generator/nn/random_stream.h"
#include "geometry/error.h"

namespace holdfast::nn {

std::vector<int> TaperedWidths(int input, int output, int num_interior) {
  std::vector<int> widths;
  for (int k = 1; k <= num_interior; ++k) {
    const double width = input + (output - input) * (double(k) / (num_interior + 1));
    widths.push_back(static_cast<int>(std::bit_ceil(static_cast<unsigned>(width))));
  }
  return widths;
}

MlpWeights RandomMlp(int input, const std::vector<int>& hidden, int output, std::uint64_t seed) {
  RandomStream random(seed);
  MlpWeights mlp;
  int in = input;
  const auto add = [&](int out) {
    const double bound = 1.0 / std::sqrt(double(in));
    const auto draw = [&] { return static_cast<float>(bound * (2.0 * random.Uniform() - 1.0)); };
    LayerWeights& layer = mlp.layers.emplace_back();
    layer.gain = Eigen::VectorXf::Ones(in);
    layer.offset = Eigen::VectorXf::Zero(in);
    layer.weight = Eigen::MatrixXf::NullaryExpr(out, in, draw);
    layer.bias = Eigen::VectorXf::NullaryExpr(out, draw);
    in = out;
  };
  for (const int width : hidden) add(width);
  add(output);
  return mlp;
}

MlpWeights MlpFromTensors(const TensorMap& tensors, const std::string& prefix,
                          const std::string& where) {
  const auto name = [&](int k, int offset, const char* what) {
    return fmt::format("{}.layers.{}.{}", prefix, 4 * k + offset, what);
  };
  MlpWeights mlp;
  for (int k = 0; k == 0 || tensors.contains(name(k, 2, "weight")); ++k) {
    const Eigen::MatrixXf weight = ReadMatrix(tensors, name(k, 2, "weight"), where);
    const Eigen::Index out = weight.rows(), in = weight.cols();
    if (k > 0 && in != mlp.OutputSize()) {
      throw Error(where,
                  fmt::format("'{}' takes {} values, the layer before it gives {}",
                              name(k, 2, "weight"), in, mlp.OutputSize()),
                  "Give a file of a network of this kind");
    }
    mlp.layers.push_back({ReadVector(tensors, name(k, 1, "weight"), where, in),
                          ReadVector(tensors, name(k, 1, "bias"), where, in), weight,
                          ReadVector(tensors, name(k, 2, "bias"), where, out)});
  }
  return mlp;
}

void AddTensors(const MlpWeights& mlp, const std::string& prefix, TensorMap& tensors) {
  for (int k = 0; k < static_cast<int>(mlp.layers.size()); ++k) {
    const LayerWeights& layer = mlp.layers[k];
    const std::string norm = fmt::format("{}.layers.{}.", prefix, 4 * k + 1);
    const std::string linear = fmt::format("{}.layers.{}.", prefix, 4 * k + 2);
    tensors[norm + "weight"] = VectorTensor(layer.gain);
    tensors[norm + "bias"] = VectorTensor(layer.offset);
    tensors[linear + "weight"] = MatrixTensor(layer.weight);
    tensors[linear + "bias"] = VectorTensor(layer.bias);
  }
}

}  // namespace holdfast::nn
