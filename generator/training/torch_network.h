// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <torch/torch.h>

#include "generator/nn/tensor.h"

namespace holdfast::wandr {

/// A network of generator/nn in LibTorch, to be trained: its parameters by the names that weights
/// files have them by. Rows are samples. What it computes is what nn::Mlp or nn::ResidualMlp
/// computes of the same weights.
class TorchNetwork {
 public:
  /// `tensors` are those of one network, without a prefix: plain where there is
  /// `layers.1.weight`, residual where there is `input.weight`. Parameters start as they are.
  explicit TorchNetwork(const nn::TensorMap& tensors);

  /// y of x (N x in). A plain network drops inputs of layers by `dropout` where it is not 0.
  torch::Tensor Forward(const torch::Tensor& x, double dropout = 0.0) const;

  /// In the order of their names.
  std::vector<torch::Tensor> Parameters() const;
  nn::TensorMap Tensors() const;
  long NumParameters() const;
  /// `visit(name, tensor)` for each.
  void ForEach(const std::function<void(const std::string&, torch::Tensor&)>& visit);

  /// A copy that takes no gradients: a running average.
  TorchNetwork Frozen() const;
  /// this += rate (other - this).
  void Follow(const TorchNetwork& other, double rate);

 private:
  const torch::Tensor& At(const std::string& name) const;
  torch::Tensor Residual(const torch::Tensor& x) const;

  std::map<std::string, torch::Tensor, std::less<>> parameters_;
  int depth_ = 0;   // layers, or blocks
  int latent_ = 0;  // of a residual network
  bool residual_ = false;
};

}  // namespace holdfast::wandr
