// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <torch/torch.h>
#include <Eigen/Core>

#include "generator/nn/network_weights.h"
#include "generator/nn/tensor.h"

namespace holdfast::wandr {

/// Sums of products that several threads share depend on how many there are.
void UseOneThreadForProducts();

/// A network's tensors by the names that TorchNetwork has them by, without a prefix.
nn::TensorMap TensorsOf(const nn::AnyWeights& weights);

/// A tensor of floats out of LibTorch and into it, copied.
nn::Tensor TensorOf(const torch::Tensor& values);
torch::Tensor TorchTensorOf(const nn::Tensor& tensor);

/// The names with "prefix." before them, as weights files have them.
nn::TensorMap Prefixed(const nn::TensorMap& tensors, const std::string& prefix);

/// The memory of a row-major tensor (N x size) as columns (size x N).
inline Eigen::Map<Eigen::MatrixXf> Columns(const torch::Tensor& tensor) {
  return {tensor.data_ptr<float>(), tensor.size(1), tensor.size(0)};
}

}  // namespace holdfast::wandr
