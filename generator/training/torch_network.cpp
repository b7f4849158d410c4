// SPDX-License-Identifier: MIT
#include "generator/training/torch_network.h"

#include "generator/nn/network_weights.h"
#include "generator/training/network_tensors.h"

namespace holdfast::wandr {

TorchNetwork::TorchNetwork(const nn::TensorMap& tensors) {
  for (const auto& [name, tensor] : tensors) {
    parameters_[name] = TorchTensorOf(tensor).requires_grad_(true);
  }
  residual_ = parameters_.contains("input.weight");
  const auto has = [&](const std::string& name) { return parameters_.contains(name); };
  if (residual_) {
    while (has("blocks." + std::to_string(depth_) + ".first.weight")) ++depth_;
    const auto latent = parameters_.find("blocks.0.latent.weight");
    if (latent != parameters_.end()) latent_ = static_cast<int>(latent->second.size(1));
  } else {
    while (has("layers." + std::to_string(4 * depth_ + 2) + ".weight")) ++depth_;
  }
}

const torch::Tensor& TorchNetwork::At(const std::string& name) const {
  return parameters_.find(name)->second;
}

torch::Tensor TorchNetwork::Residual(const torch::Tensor& x) const {
  const auto norm = [&](const torch::Tensor& h, const std::string& name) {
    return torch::layer_norm(h, {h.size(1)}, At(name + ".weight"), At(name + ".bias"),
                             nn::kLayerNormEpsilon);
  };
  const auto linear = [&](const torch::Tensor& h, const std::string& name) {
    return torch::linear(h, At(name + ".weight"), At(name + ".bias"));
  };
  const torch::Tensor z = latent_ > 0 ? x.narrow(1, 0, latent_) : torch::Tensor();
  torch::Tensor h = linear(x, "input");
  for (int k = 0; k < depth_; ++k) {
    const std::string block = "blocks." + std::to_string(k);
    torch::Tensor inner = linear(norm(h, block + ".norm"), block + ".first");
    if (latent_ > 0) inner = inner + torch::linear(z, At(block + ".latent.weight"));
    h = h + linear(torch::silu(inner), block + ".second");
  }
  return linear(norm(h, "output_norm"), "output");
}

torch::Tensor TorchNetwork::Forward(const torch::Tensor& x, double dropout) const {
  if (residual_) return Residual(x);
  torch::Tensor h = x;
  for (int k = 0; k < depth_; ++k) {
    const std::string norm = "layers." + std::to_string(4 * k + 1);
    const std::string linear = "layers." + std::to_string(4 * k + 2);
    if (dropout > 0.0) h = torch::dropout(h, dropout, true);
    h = torch::layer_norm(h, {h.size(1)}, At(norm + ".weight"), At(norm + ".bias"),
                          nn::kLayerNormEpsilon);
    h = torch::linear(h, At(linear + ".weight"), At(linear + ".bias"));
    if (k + 1 < depth_) h = torch::relu(h);
  }
  return h;
}

std::vector<torch::Tensor> TorchNetwork::Parameters() const {
  std::vector<torch::Tensor> all;
  for (const auto& [name, tensor] : parameters_) all.push_back(tensor);
  return all;
}

nn::TensorMap TorchNetwork::Tensors() const {
  nn::TensorMap out;
  for (const auto& [name, parameter] : parameters_) out[name] = TensorOf(parameter);
  return out;
}

long TorchNetwork::NumParameters() const {
  long count = 0;
  for (const auto& [name, parameter] : parameters_) count += parameter.numel();
  return count;
}

void TorchNetwork::ForEach(const std::function<void(const std::string&, torch::Tensor&)>& visit) {
  for (auto& [name, parameter] : parameters_) visit(name, parameter);
}

TorchNetwork TorchNetwork::Frozen() const {
  TorchNetwork copy = *this;
  for (auto& [name, parameter] : copy.parameters_) {
    parameter = parameter.detach().clone().requires_grad_(false);
  }
  return copy;
}

void TorchNetwork::Follow(const TorchNetwork& other, double rate) {
  const torch::NoGradGuard no_gradients;
  for (auto& [name, parameter] : parameters_) {
    parameter.lerp_(other.parameters_.find(name)->second.detach(), rate);
  }
}

}  // namespace holdfast::wandr
