// SPDX-License-Identifier: MIT
#include "generator/nn/any_weights.h"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast::nn {
namespace {

constexpr std::string_view kChain = "layers.";
constexpr std::array<std::string_view, 4> kResidual{"input.", "blocks.", "output_norm.", "output."};

// What follows "<prefix>." in `name`; empty where it does not begin so.
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
                "Give a file of one network: this one was put together from two");
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
