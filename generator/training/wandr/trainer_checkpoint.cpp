// SPDX-License-Identifier: MIT
#include <cstdlib>

#include <fmt/format.h>

#include "generator/training/checkpoint_file.h"
#include "generator/training/wandr/trainer_state.h"

namespace holdfast::wandr {
namespace {

constexpr const char* kFormat = "wandr-training-2";

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

}  // namespace

void Trainer::Save(const std::filesystem::path& path) const {
  const Impl& s = *impl_;
  CheckpointWriter file(kFormat, Fingerprint(s.options, s.corpus));
  file.AddText("iteration", std::to_string(s.iteration));
  file.AddText("reference_since", std::to_string(s.reference_since));
  file.Add("decoder", s.decoder);
  file.Add("encoder", s.encoder);
  file.Add("mean.decoder", s.mean_decoder);
  file.Add("mean.encoder", s.mean_encoder);
  if (s.reference) file.Add("reference", *s.reference);
  file.Add("critic", s.critic.Network());
  file.AddMoments<AdamWState>("adam", s.optimizer, s.AllParameters());
  file.AddMoments<AdamState>("critic_adam", s.critic.Optimizer(), s.critic.Network().Parameters());
  file.Write(path);
}

void Trainer::Load(const std::filesystem::path& path) {
  Impl& s = *impl_;
  const CheckpointReader file(path, kFormat, Fingerprint(s.options, s.corpus));
  file.Fill("decoder", s.decoder);
  file.Fill("encoder", s.encoder);
  file.Fill("mean.decoder", s.mean_decoder);
  file.Fill("mean.encoder", s.mean_encoder);
  if (file.Has("reference." + std::string(s.options.residual ? "input" : "layers.1") + ".weight")) {
    s.reference = s.mean_decoder.Frozen();
    file.Fill("reference", *s.reference);
  }
  file.ReadMoments<AdamWState>("adam", s.AllParameters(), s.optimizer);
  if (file.Has("critic.input.weight")) {
    file.Fill("critic", s.critic.Network());
    file.ReadMoments<AdamState>("critic_adam", s.critic.Network().Parameters(),
                                s.critic.Optimizer());
  }
  s.iteration = std::atol(file.Text("iteration").c_str());
  s.reference_since = std::atol(file.Text("reference_since").c_str());
}

}  // namespace holdfast::wandr
