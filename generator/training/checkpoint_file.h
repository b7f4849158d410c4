// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include <fmt/format.h>
#include <torch/torch.h>

#include "generator/nn/tensor.h"
#include "generator/training/torch_network.h"
#include "geometry/io/container/safetensors.h"

namespace holdfast {

/// The key of a parameter in an optimizer's state: its address, which libtorch before 2.1 has as
/// text.
template <typename Optimizer>
auto OptimizerKey(const Optimizer& optimizer, const torch::Tensor& parameter) {
  using Key = typename std::decay_t<decltype(optimizer.state())>::key_type;
  if constexpr (std::is_same_v<Key, std::string>) {
    return fmt::format("{}", fmt::ptr(parameter.unsafeGetTensorImpl()));
  } else {
    return static_cast<Key>(parameter.unsafeGetTensorImpl());
  }
}

/// Puts a checkpoint together: tensors, texts, and what an optimizer of Adam's kind remembers.
class CheckpointWriter {
 public:
  /// `options`: all that must agree for a training to go on.
  CheckpointWriter(const std::string& format, const std::string& options);

  void Add(const std::string& name, const torch::Tensor& values);
  /// Under "name.".
  void Add(const std::string& name, const wandr::TorchNetwork& network);
  void AddText(const std::string& name, const std::string& text) { texts_[name] = text; }
  /// Moments and steps of those parameters that have been moved; `ParamState` as libtorch names it.
  template <typename ParamState, typename Optimizer>
  void AddMoments(const std::string& name, const Optimizer& optimizer,
                  const std::vector<torch::Tensor>& parameters) {
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      const auto found = optimizer.state().find(OptimizerKey(optimizer, parameters[k]));
      if (found == optimizer.state().end()) continue;
      const auto& state = static_cast<const ParamState&>(*found->second);
      const std::string of = fmt::format("{}.{}", name, k);
      Add(of + ".first", state.exp_avg());
      Add(of + ".second", state.exp_avg_sq());
      texts_[of] = std::to_string(state.step());
    }
  }
  /// Atomic.
  void Write(const std::filesystem::path& path);

 private:
  SafetensorsWriter writer_;
  SafetensorsMetadata texts_;
};

/// Reads what CheckpointWriter wrote.
class CheckpointReader {
 public:
  /// Throws Error for a file of another format, or of other options.
  CheckpointReader(const std::filesystem::path& path, const std::string& format,
                   const std::string& options);

  bool Has(const std::string& name) const { return file_.Has(name); }
  /// Empty where there is none.
  std::string Text(const std::string& name) const;
  /// Throws Error for what is missing or of another size.
  void Fill(const std::string& name, torch::Tensor& tensor) const;
  void Fill(const std::string& name, wandr::TorchNetwork& network) const;
  template <typename ParamState, typename Optimizer>
  void ReadMoments(const std::string& name, const std::vector<torch::Tensor>& parameters,
                   Optimizer& optimizer) const {
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      const std::string of = fmt::format("{}.{}", name, k);
      if (!Has(of + ".first")) continue;
      auto state = std::make_unique<ParamState>();
      torch::Tensor first = torch::zeros_like(parameters[k]), second = first.clone();
      Fill(of + ".first", first);
      Fill(of + ".second", second);
      state->step(std::atol(Text(of).c_str()));
      state->exp_avg(first);
      state->exp_avg_sq(second);
      optimizer.state()[OptimizerKey(optimizer, parameters[k])] = std::move(state);
    }
  }
  /// An Error of this file: damaged, begin anew.
  [[noreturn]] void Damaged(const std::string& problem) const;

 private:
  std::string where_;
  SafetensorsReader file_;
};

}  // namespace holdfast
