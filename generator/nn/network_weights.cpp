// SPDX-License-Identifier: MIT
#include "generator/nn/network_weights.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "generator/nn/random_stream.h"
#include "generator/nn/tensor.h"
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

namespace {

// Returns one more than the highest k of the names `<prefix>.blocks.<k>.`, and at least 1, so that
// the names of missing tensors appear in errors.
int NumBlocks(const TensorMap& tensors, const std::string& prefix) {
  const std::string begin = prefix + ".blocks.";
  int count = 1;
  for (auto it = tensors.lower_bound(begin); it != tensors.end(); ++it) {
    if (!it->first.starts_with(begin)) break;
    const std::string_view rest = std::string_view(it->first).substr(begin.size());
    int k = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), k);
    // A huge number is an unknown name, not a count to loop over.
    if (error == std::errc() && k >= 0 && k < 1000) count = std::max(count, k + 1);
  }
  return count;
}

void CheckNamesKnown(const TensorMap& tensors, const std::string& prefix, const TensorMap& known,
                     const std::string& where) {
  const std::string begin = prefix + ".";
  for (auto it = tensors.lower_bound(begin); it != tensors.end(); ++it) {
    if (!it->first.starts_with(begin)) break;
    if (!known.contains(it->first)) {
      throw Error(where, fmt::format("a residual network has no tensor '{}'", it->first),
                  kNetworkRemedy);
    }
  }
}

}  // namespace

ResidualWeights RandomResidual(int input, int latent, int width, int blocks, int output,
                               std::uint64_t seed) {
  RandomStream random(seed);
  const auto matrix = [&](int out, int in) -> Eigen::MatrixXf {
    const double bound = 1.0 / std::sqrt(double(std::max(in, 1)));
    return Eigen::MatrixXf::NullaryExpr(
        out, in, [&] { return static_cast<float>(bound * (2.0 * random.Uniform() - 1.0)); });
  };
  const auto bias = [&](int out, int in) -> Eigen::VectorXf {
    return matrix(out, 1) / std::sqrt(static_cast<float>(in));
  };
  const Eigen::VectorXf ones = Eigen::VectorXf::Ones(width), zeros = Eigen::VectorXf::Zero(width);
  ResidualWeights network;
  network.input_weight = matrix(width, input);
  network.input_bias = bias(width, input);
  for (int k = 0; k < blocks; ++k) {
    ResidualWeights::Block& block = network.blocks.emplace_back();
    block.gain = ones;
    block.offset = zeros;
    block.first_weight = matrix(width, width);
    block.latent_weight = matrix(width, latent);
    block.first_bias = bias(width, width);
    block.second_weight = matrix(width, width);
    block.second_bias = bias(width, width);
  }
  network.output_gain = ones;
  network.output_offset = zeros;
  network.output_weight = matrix(output, width);
  network.output_bias = bias(output, width);
  return network;
}

ResidualWeights ResidualFromTensors(const TensorMap& tensors, const std::string& prefix,
                                    const std::string& where) {
  ResidualWeights network;
  network.input_weight = ReadMatrix(tensors, prefix + ".input.weight", where);
  const Eigen::Index width = network.input_weight.rows(), input = network.input_weight.cols();
  const auto vector = [&](const std::string& name, Eigen::Index size) {
    return ReadVector(tensors, prefix + name, where, size);
  };
  const auto square = [&](const std::string& name) {
    return ReadMatrix(tensors, prefix + name, where, width, width);
  };
  network.input_bias = vector(".input.bias", width);
  const int blocks = NumBlocks(tensors, prefix);
  const std::string first_latent = prefix + ".blocks.0.latent.weight";
  Eigen::Index latent = 0;
  if (tensors.contains(first_latent)) latent = ReadMatrix(tensors, first_latent, where).cols();
  if (latent > input) {
    throw Error(
        where,
        fmt::format("'{}' takes {} values, the whole input has {}", first_latent, latent, input),
        kNetworkRemedy);
  }
  for (int k = 0; k < blocks; ++k) {
    const std::string name = fmt::format(".blocks.{}.", k);
    ResidualWeights::Block& block = network.blocks.emplace_back();
    block.gain = vector(name + "norm.weight", width);
    block.offset = vector(name + "norm.bias", width);
    block.first_weight = square(name + "first.weight");
    block.first_bias = vector(name + "first.bias", width);
    block.latent_weight.resize(width, 0);
    if (latent > 0) {
      block.latent_weight =
          ReadMatrix(tensors, prefix + name + "latent.weight", where, width, latent);
    }
    block.second_weight = square(name + "second.weight");
    block.second_bias = vector(name + "second.bias", width);
  }
  network.output_gain = vector(".output_norm.weight", width);
  network.output_offset = vector(".output_norm.bias", width);
  network.output_weight = ReadMatrix(tensors, prefix + ".output.weight", where);
  if (network.output_weight.cols() != width) {
    throw Error(where,
                fmt::format("'{}.output.weight' takes {} values, the network's width is {}", prefix,
                            network.output_weight.cols(), width),
                kNetworkRemedy);
  }
  network.output_bias = vector(".output.bias", network.output_weight.rows());
  TensorMap known;
  AddTensors(network, prefix, known);
  CheckNamesKnown(tensors, prefix, known, where);
  return network;
}

void AddTensors(const ResidualWeights& network, const std::string& prefix, TensorMap& tensors) {
  const auto matrix = [&](const std::string& name, const Eigen::MatrixXf& value) {
    tensors[prefix + name] = MatrixTensor(value);
  };
  const auto vector = [&](const std::string& name, const Eigen::VectorXf& value) {
    tensors[prefix + name] = VectorTensor(value);
  };
  matrix(".input.weight", network.input_weight);
  vector(".input.bias", network.input_bias);
  for (std::size_t k = 0; k < network.blocks.size(); ++k) {
    const ResidualWeights::Block& block = network.blocks[k];
    const std::string name = fmt::format(".blocks.{}.", k);
    vector(name + "norm.weight", block.gain);
    vector(name + "norm.bias", block.offset);
    matrix(name + "first.weight", block.first_weight);
    vector(name + "first.bias", block.first_bias);
    if (block.latent_weight.cols() > 0) matrix(name + "latent.weight", block.latent_weight);
    matrix(name + "second.weight", block.second_weight);
    vector(name + "second.bias", block.second_bias);
  }
  vector(".output_norm.weight", network.output_gain);
  vector(".output_norm.bias", network.output_offset);
  matrix(".output.weight", network.output_weight);
  vector(".output.bias", network.output_bias);
}

namespace {

constexpr std::string_view kChain = "layers.";
constexpr std::array<std::string_view, 4> kResidual{"input.", "blocks.", "output_norm.", "output."};

// Returns the part of `name` after "<prefix>.", or an empty string if it has no such prefix.
std::string_view RestOf(const std::string& prefix, std::string_view name) {
  if (!name.starts_with(prefix) || name.size() <= prefix.size() || name[prefix.size()] != '.') {
    return {};
  }
  return name.substr(prefix.size() + 1);
}

bool IsResidualName(std::string_view rest) {
  return std::any_of(kResidual.begin(), kResidual.end(),
                     [&](std::string_view begin) { return rest.starts_with(begin); });
}

}  // namespace

int InputSize(const AnyWeights& weights) {
  return std::visit([](const auto& network) { return network.InputSize(); }, weights);
}

int OutputSize(const AnyWeights& weights) {
  return std::visit([](const auto& network) { return network.OutputSize(); }, weights);
}

bool IsTensorOf(const std::string& prefix, const std::string& name) {
  const std::string_view rest = RestOf(prefix, name);
  return rest.starts_with(kChain) || IsResidualName(rest);
}

AnyWeights AnyFromTensors(const TensorMap& tensors, const std::string& prefix,
                          const std::string& where) {
  const std::string *chain = nullptr, *residual = nullptr;
  for (const auto& [name, tensor] : tensors) {
    const std::string_view rest = RestOf(prefix, name);
    if (rest.starts_with(kChain)) chain = &name;
    if (IsResidualName(rest)) residual = &name;
  }
  if (chain && residual) {
    throw Error(where,
                fmt::format("'{}' belongs to a chain of layers, '{}' to a residual network", *chain,
                            *residual),
                "Give a file with the weights of one network");
  }
  if (!chain && !residual) {
    throw Error(where,
                fmt::format("there is no tensor '{0}.layers.*' and none '{0}.input.*'", prefix),
                "Give a file of a network of this kind");
  }
  if (residual) return ResidualFromTensors(tensors, prefix, where);
  return MlpFromTensors(tensors, prefix, where);
}

void AddTensors(const AnyWeights& weights, const std::string& prefix, TensorMap& tensors) {
  std::visit([&](const auto& network) { AddTensors(network, prefix, tensors); }, weights);
}

}  // namespace holdfast::nn
