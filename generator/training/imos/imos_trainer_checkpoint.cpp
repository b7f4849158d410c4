// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <memory>

#include <fmt/format.h>

#include "generator/training/checkpoint_file.h"
#include "generator/training/imos/imos_trainer_state.h"

namespace holdfast::imos {
namespace {

constexpr const char* kFormat = "imos-training-2";
using AdamState = torch::optim::AdamWParamState;

// What must agree for a training to go on: what shapes the weights and the draws. Threads do not.
std::string Fingerprint(const TrainingOptions& o, const std::string& data) {
  std::string text = fmt::format(
      "published {} {} iterations {} batch {} shard {} rate {} decay {} clip {} dropout {} present "
      "{} "
      "noise {} {} {} lengthen {} running {} critic {} {} {} losses {} {} {} {} {} {} {} seed {} "
      "data {}",
      o.as_published, o.true_history_epochs, o.iterations, o.batch, o.shard, o.learning_rate,
      o.weight_decay, o.largest_gradient, o.dropout, o.present_share, o.history_noise,
      o.shape_noise, o.stance_noise_rad, o.lengthen_until, o.running_from, o.critic, o.critic_from,
      o.critic_blur_m, o.losses.divergence, o.losses.pose, o.losses.velocity, o.losses.joints,
      o.losses.num_joints, o.losses.wrists, o.losses.root, o.seed, data);
  for (const auto& [name, value] : ConfigTexts(o.config))
    text += fmt::format(" {} {}", name, value);
  return text;
}

}  // namespace

void Trainer::Save(const std::filesystem::path& path) const {
  const Impl& s = *impl_;
  CheckpointWriter file(kFormat, Fingerprint(s.options, s.fingerprint_of_data));
  file.AddText("iteration", std::to_string(s.iteration));
  for (const auto& [name, tensor] : s.networks.Named()) file.Add("network." + name, tensor);
  for (const OptimizerOf& optimizer : s.optimizers) {
    file.AddMoments<AdamState>(optimizer.name, *optimizer.adam, optimizer.parameters);
    file.AddText(
        optimizer.name + ".plateau",
        fmt::format("{:.17g} {:.17g} {} {:.17g}", optimizer.plateau.rate, optimizer.plateau.best,
                    optimizer.plateau.bad_epochs, optimizer.epoch_loss));
  }
  file.Add("critic", s.critic.Network());
  file.AddMoments<AdamState>("critic_adam", s.critic.Optimizer(), s.critic.Network().Parameters());
  file.Write(path);
}

void Trainer::Load(const std::filesystem::path& path) {
  Impl& s = *impl_;
  const CheckpointReader file(path, kFormat, Fingerprint(s.options, s.fingerprint_of_data));
  for (auto& [name, tensor] : s.networks.Named()) file.Fill("network." + name, tensor);
  for (OptimizerOf& optimizer : s.optimizers) {
    file.ReadMoments<AdamState>(optimizer.name, optimizer.parameters, *optimizer.adam);
    const std::string plateau = file.Text(optimizer.name + ".plateau");
    if (std::sscanf(plateau.c_str(), "%lf %lf %d %lf", &optimizer.plateau.rate,
                    &optimizer.plateau.best, &optimizer.plateau.bad_epochs,
                    &optimizer.epoch_loss) != 4) {
      file.Damaged(fmt::format("has no schedule of '{}'", optimizer.name));
    }
  }
  file.Fill("critic", s.critic.Network());
  file.ReadMoments<AdamState>("critic_adam", s.critic.Network().Parameters(), s.critic.Optimizer());
  s.iteration = std::atol(file.Text("iteration").c_str());
}

}  // namespace holdfast::imos
