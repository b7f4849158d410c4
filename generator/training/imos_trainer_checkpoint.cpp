// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <memory>

#include <fmt/format.h>

#include "generator/training/imos_trainer_state.h"
#include "geometry/error.h"
#include "geometry/io/safetensors.h"

namespace holdfast::imos {
namespace {

constexpr const char* kFormat = "imos-training-1";
using AdamState = torch::optim::AdamWParamState;

// What must agree for a training to go on: what shapes the weights and the draws. Threads do not.
std::string Fingerprint(const TrainingOptions& o, const std::string& data) {
  std::string text = fmt::format(
      "published {} {} iterations {} batch {} shard {} rate {} decay {} clip {} dropout {} present "
      "{} "
      "noise {} {} lengthen {} running {} losses {} {} {} {} {} {} {} seed {} data {}",
      o.as_published, o.true_history_epochs, o.iterations, o.batch, o.shard, o.learning_rate,
      o.weight_decay, o.largest_gradient, o.dropout, o.present_share, o.history_noise,
      o.shape_noise, o.lengthen_until, o.running_from, o.losses.divergence, o.losses.pose,
      o.losses.velocity, o.losses.joints, o.losses.num_joints, o.losses.wrists, o.losses.root,
      o.seed, data);
  for (const auto& [name, value] : ConfigTexts(o.config))
    text += fmt::format(" {} {}", name, value);
  return text;
}

std::string KeyOf(const torch::Tensor& parameter) {
  return c10::guts::to_string(parameter.unsafeGetTensorImpl());
}

}  // namespace

void Trainer::Save(const std::filesystem::path& path) const {
  const Impl& s = *impl_;
  SafetensorsWriter writer;
  SafetensorsMetadata texts{{"format", kFormat},
                            {"iteration", std::to_string(s.iteration)},
                            {"options", Fingerprint(s.options, s.fingerprint_of_data)}};
  const auto add = [&](const std::string& name, const torch::Tensor& tensor) {
    const torch::Tensor values = tensor.detach().contiguous();
    writer.AddFloat32(name, {values.sizes().begin(), values.sizes().end()},
                      {values.data_ptr<float>(), static_cast<std::size_t>(values.numel())});
  };
  for (const auto& [name, tensor] : s.networks.Named()) add("network." + name, tensor);
  for (const OptimizerOf& optimizer : s.optimizers) {
    for (std::size_t k = 0; k < optimizer.parameters.size(); ++k) {
      const auto found = optimizer.adam->state().find(KeyOf(optimizer.parameters[k]));
      if (found == optimizer.adam->state().end()) continue;
      const auto& state = static_cast<const AdamState&>(*found->second);
      const std::string name = fmt::format("{}.{}", optimizer.name, k);
      add(name + ".first", state.exp_avg());
      add(name + ".second", state.exp_avg_sq());
      texts[name] = std::to_string(state.step());
    }
    texts[optimizer.name + ".plateau"] =
        fmt::format("{:.17g} {:.17g} {} {:.17g}", optimizer.plateau.rate, optimizer.plateau.best,
                    optimizer.plateau.bad_epochs, optimizer.epoch_loss);
  }
  writer.SetMetadata(texts);
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
    throw Error(where, "is no checkpoint of a training of IMoS",
                "Give a checkpoint.safetensors, or --force");
  }
  const std::string wanted = Fingerprint(s.options, s.fingerprint_of_data);
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
  for (auto& [name, tensor] : s.networks.Named()) fill("network." + name, tensor);
  for (OptimizerOf& optimizer : s.optimizers) {
    for (std::size_t k = 0; k < optimizer.parameters.size(); ++k) {
      const std::string name = fmt::format("{}.{}", optimizer.name, k);
      if (!file.Has(name + ".first")) continue;
      auto state = std::make_unique<AdamState>();
      torch::Tensor first = torch::zeros_like(optimizer.parameters[k]), second = first.clone();
      fill(name + ".first", first);
      fill(name + ".second", second);
      state->step(std::atol(text(name).c_str()));
      state->exp_avg(first);
      state->exp_avg_sq(second);
      optimizer.adam->state()[KeyOf(optimizer.parameters[k])] = std::move(state);
    }
    const std::string plateau = text(optimizer.name + ".plateau");
    if (std::sscanf(plateau.c_str(), "%lf %lf %d %lf", &optimizer.plateau.rate,
                    &optimizer.plateau.best, &optimizer.plateau.bad_epochs,
                    &optimizer.epoch_loss) != 4) {
      throw Error(where, fmt::format("has no schedule of '{}'", optimizer.name),
                  "The file is damaged: begin anew with --force");
    }
  }
  s.iteration = std::atol(text("iteration").c_str());
}

}  // namespace holdfast::imos
