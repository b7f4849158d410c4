// SPDX-License-Identifier: MIT
#include "generator/imos/recognition.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "generator/imos/vocabulary.h"
#include "generator/nn/random_stream.h"

namespace holdfast::imos {

nn::TensorMap RandomRecognizer(std::uint64_t seed) {
  constexpr std::size_t kPlaneInputs = 2 * 22, kHidden = 128, kGates = 4 * kHidden;
  nn::RandomStream random(seed);
  nn::TensorMap tensors;
  const auto add = [&](const std::string& name, std::vector<std::size_t> shape, double fan_in) {
    std::size_t size = 1;
    for (const std::size_t length : shape) size *= length;
    nn::Tensor tensor{std::move(shape), std::vector<float>(size)};
    const double bound = 1.0 / std::sqrt(fan_in);
    for (float& value : tensor.values) {
      value = static_cast<float>(bound * (2.0 * random.Uniform() - 1.0));
    }
    tensors[name] = std::move(tensor);
  };
  for (const char* plane : {"2_2", "2_3"}) {
    for (int layer = 0; layer < 2; ++layer) {
      const auto name = [&](const char* what) {
        return fmt::format("lstm{}.{}_l{}", plane, what, layer);
      };
      const std::size_t inputs = layer == 0 ? kPlaneInputs : kHidden;
      add(name("weight_ih"), {kGates, inputs}, kHidden);
      add(name("weight_hh"), {kGates, kHidden}, kHidden);
      add(name("bias_ih"), {kGates}, kHidden);
      add(name("bias_hh"), {kGates}, kHidden);
    }
    add(fmt::format("conv1_{}.weight", plane), {1, 1, 3}, 3);
    add(fmt::format("conv1_{}.bias", plane), {1}, 3);
  }
  add("hidden2label.weight", {kNumActions, kHidden}, kHidden);
  add("hidden2label.bias", {kNumActions}, kHidden);
  return tensors;
}

}  // namespace holdfast::imos
