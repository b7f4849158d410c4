// SPDX-License-Identifier: MIT
#include <map>
#include <memory>

#include <fmt/format.h>

#include "generator/training/network_tensors.h"
#include "generator/training/trainer_state.h"
#include "geometry/error.h"
#include "geometry/io/safetensors.h"

namespace holdfast::wandr {
namespace {

constexpr const char* kFormat = "wandr-training-1";

// What must agree for a training to go on: what shapes the weights and the draws.
std::string Fingerprint(const TrainingOptions& o, const Corpus& corpus) {
  return fmt::format(
      "residual {} width {} blocks {} latent {} layout {} seed {} frames {} unroll {} "
      "iterations {} corpus {}+{} frames in {} clips",
      o.residual, o.width, o.blocks, o.latent_size, static_cast<int>(o.layout), o.seed,
      o.frames_per_iteration, o.longest_unroll, o.iterations, corpus.captured_frames,
      corpus.made_frames, corpus.clips.size());
}

using AdamWState = torch::optim::AdamWParamState;
using AdamState = torch::optim::AdamParamState;

std::string KeyOf(const torch::Tensor& parameter) {
  return c10::guts::to_string(parameter.unsafeGetTensorImpl());
}

}  // namespace

void Trainer::Save(const std::filesystem::path& path) const {
  const Impl& s = *impl_;
  SafetensorsWriter writer;
  std::map<std::string, std::string> steps{{"adam", "0"}, {"critic_adam", "0"}};
  const auto add = [&](const std::string& prefix, const TorchNetwork& network) {
    for (const auto& [name, tensor] : Prefixed(network.Tensors(), prefix)) {
      writer.AddFloat32(name, tensor.shape, tensor.values);
    }
  };
  add("decoder", s.decoder);
  add("encoder", s.encoder);
  add("mean.decoder", s.mean_decoder);
  add("mean.encoder", s.mean_encoder);
  if (s.reference) add("reference", *s.reference);
  add("critic", s.critic.Network());
  const auto add_moment = [&](const std::string& name, const torch::Tensor& moment) {
    const torch::Tensor values = moment.contiguous();
    writer.AddFloat32(name, {static_cast<std::size_t>(values.numel())},
                      {values.data_ptr<float>(), static_cast<std::size_t>(values.numel())});
  };
  const auto add_moments = [&](const std::string& prefix, const auto& optimizer,
                               const std::vector<torch::Tensor>& parameters, auto* state_type) {
    using State = std::remove_pointer_t<decltype(state_type)>;
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      const auto found = optimizer.state().find(KeyOf(parameters[k]));
      if (found == optimizer.state().end()) continue;
      const auto& state = static_cast<const State&>(*found->second);
      add_moment(fmt::format("{}.{}.first", prefix, k), state.exp_avg());
      add_moment(fmt::format("{}.{}.second", prefix, k), state.exp_avg_sq());
      steps[prefix] = std::to_string(state.step());
    }
  };
  add_moments("adam", s.optimizer, s.AllParameters(), static_cast<AdamWState*>(nullptr));
  add_moments("critic_adam", s.critic.Optimizer(), s.critic.Network().Parameters(),
              static_cast<AdamState*>(nullptr));
  writer.SetMetadata({{"format", kFormat},
                      {"iteration", std::to_string(s.iteration)},
                      {"reference_since", std::to_string(s.reference_since)},
                      {"adam", steps["adam"]},
                      {"critic_adam", steps["critic_adam"]},
                      {"options", Fingerprint(s.options, s.corpus)}});
  writer.Write(path);
}

void Trainer::Load(const std::filesystem::path& path) {
  Impl& s = *impl_;
  const SafetensorsReader file(path);
  const std::string where = path.string();
  const auto text = [&](const std::string& key) -> std::string {
    const auto found = file.Metadata().find(key);
    return found == file.Metadata().end() ? "" : found->second;
  };
  if (text("format") != kFormat) {
    throw Error(where, "is no checkpoint of a training",
                "Give a checkpoint.safetensors, or --force");
  }
  const std::string wanted = Fingerprint(s.options, s.corpus);
  if (text("options") != wanted) {
    throw Error(
        where,
        fmt::format("was made with other options or data ({}), not {}", text("options"), wanted),
        "Give the same options, or another --output, or --force to begin anew");
  }
  const torch::NoGradGuard no_gradients;
  const auto fill = [&](const std::string& name, torch::Tensor& tensor) {
    const std::vector<float> values = file.Read(name).AsFloats();
    if (static_cast<std::int64_t>(values.size()) != tensor.numel()) {
      throw Error(where,
                  fmt::format("{} has {} values, not {}", name, values.size(), tensor.numel()),
                  "The file is damaged: begin anew with --force");
    }
    std::copy(values.begin(), values.end(), tensor.data_ptr<float>());
  };
  const auto read = [&](const std::string& prefix, TorchNetwork& network) {
    network.ForEach(
        [&](const std::string& name, torch::Tensor& tensor) { fill(prefix + "." + name, tensor); });
  };
  read("decoder", s.decoder);
  read("encoder", s.encoder);
  read("mean.decoder", s.mean_decoder);
  read("mean.encoder", s.mean_encoder);
  if (file.Has("reference." + std::string(s.options.residual ? "input" : "layers.1") + ".weight")) {
    s.reference = s.mean_decoder.Frozen();
    read("reference", *s.reference);
  }
  const auto read_moments = [&](const std::string& prefix, auto& optimizer,
                                const std::vector<torch::Tensor>& parameters, auto* state_type) {
    using State = std::remove_pointer_t<decltype(state_type)>;
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      const std::string name = fmt::format("{}.{}", prefix, k);
      if (!file.Has(name + ".first")) continue;
      auto state = std::make_unique<State>();
      torch::Tensor first = torch::zeros_like(parameters[k]), second = first.clone();
      fill(name + ".first", first);
      fill(name + ".second", second);
      state->step(std::atol(text(prefix).c_str()));
      state->exp_avg(first);
      state->exp_avg_sq(second);
      optimizer.state()[KeyOf(parameters[k])] = std::move(state);
    }
  };
  read_moments("adam", s.optimizer, s.AllParameters(), static_cast<AdamWState*>(nullptr));
  if (file.Has("critic.input.weight")) {
    read("critic", s.critic.Network());
    read_moments("critic_adam", s.critic.Optimizer(), s.critic.Network().Parameters(),
                 static_cast<AdamState*>(nullptr));
  }
  const long iteration = std::atol(text("iteration").c_str());
  s.iteration = iteration;
  s.reference_since = std::atol(text("reference_since").c_str());
}

}  // namespace holdfast::wandr
