// SPDX-License-Identifier: MIT
#include "generator/training/network_tensors.h"

namespace holdfast::wandr {

nn::TensorMap TensorsOf(const nn::AnyWeights& weights) {
  nn::TensorMap named, plain;
  nn::AddTensors(weights, "net", named);
  for (auto& [name, tensor] : named) plain[name.substr(4)] = std::move(tensor);
  return plain;
}

nn::TensorMap Prefixed(const nn::TensorMap& tensors, const std::string& prefix) {
  nn::TensorMap out;
  for (const auto& [name, tensor] : tensors) out[prefix + "." + name] = tensor;
  return out;
}

}  // namespace holdfast::wandr
