// SPDX-License-Identifier: MIT
#include "generator/nn/residual_weights.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "generator/nn/random_stream.h"
#include "generator/nn/tensor.h"
#include "geometry/error.h"

namespace holdfast::nn {
namespace {

// One more than the highest k of the names `<prefix>.blocks.<k>.`, and at least 1, so that what is
// missing below it is asked for by name.
int NumBlocks(const TensorMap& tensors, const std::string& prefix) {
  const std::string begin = prefix + ".blocks.";
  int count = 1;
  for (auto it = tensors.lower_bound(begin); it != tensors.end(); ++it) {
    if (!it->first.starts_with(begin)) break;
    const std::string_view rest = std::string_view(it->first).substr(begin.size());
    int k = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), k);
    // A number that no network reaches is an unknown name, not a count to loop over.
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

}  // namespace holdfast::nn
