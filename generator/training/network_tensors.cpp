// SPDX-License-Identifier: MIT
#include "generator/training/network_tensors.h"

#include "geometry/parallel.h"

namespace holdfast::wandr {

void UseOneThreadForProducts() {
  at::set_num_threads(1);
  EndBlasThreads();
}

nn::TensorMap TensorsOf(const nn::AnyWeights& weights) {
  nn::TensorMap named, plain;
  nn::AddTensors(weights, "net", named);
  for (auto& [name, tensor] : named) plain[name.substr(4)] = std::move(tensor);
  return plain;
}

nn::Tensor TensorOf(const torch::Tensor& values) {
  const torch::Tensor dense = values.detach().contiguous();
  return {{dense.sizes().begin(), dense.sizes().end()},
          {dense.data_ptr<float>(), dense.data_ptr<float>() + dense.numel()}};
}

torch::Tensor TorchTensorOf(const nn::Tensor& tensor) {
  torch::Tensor values =
      torch::empty(std::vector<std::int64_t>(tensor.shape.begin(), tensor.shape.end()));
  std::copy(tensor.values.begin(), tensor.values.end(), values.data_ptr<float>());
  return values;
}

nn::TensorMap Prefixed(const nn::TensorMap& tensors, const std::string& prefix) {
  nn::TensorMap out;
  for (const auto& [name, tensor] : tensors) out[prefix + "." + name] = tensor;
  return out;
}

}  // namespace holdfast::wandr
