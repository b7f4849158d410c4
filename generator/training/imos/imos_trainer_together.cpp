// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <ATen/CPUGeneratorImpl.h>

#include "generator/training/imos/imos_augmentation.h"
#include "generator/training/imos/imos_trainer_state.h"
#include "geometry/parallel.h"

namespace holdfast::imos {
namespace {

constexpr double kCriticRamp = 0.1;  // share of the iterations in which its weight grows

}  // namespace

struct Trainer::Impl::Shard {
  std::vector<torch::Tensor> gradients;
  Pass pass;
  Losses losses;
  torch::Tensor true_motions, own_motions, actions;  // for the critic to learn from
};

torch::Tensor Trainer::Impl::DoubtOf(const std::vector<torch::Tensor>& frames,
                                     const SequenceTensors& batch, double share, Shard& out) const {
  const torch::Tensor motions =
      critic.Motions(ActionCritic::Blurred(frames, options.critic_blur_m, *out.pass.generator));
  const torch::Tensor doubt = critic.Doubt(motions, batch.action);
  // It knows nothing at first.
  const double known = std::min(1.0, (Progress() - options.critic_from) / kCriticRamp);
  const torch::Tensor weighed = share * known * options.critic * doubt;
  out.losses.doubt = share * doubt.item<double>();
  out.losses.total += weighed.item<double>();
  out.own_motions = motions.detach();
  out.actions = batch.action;
  return weighed;
}

void Trainer::Impl::UnrollShard(SequenceTensors batch, double share, const Window& window,
                                std::uint64_t seed, Shard& out) const {
  at::Generator generator = at::detail::createCPUGenerator(seed);
  DisturbShapes(batch, options.shape_noise, generator);
  DisturbStances(batch, options.stance_noise_rad, generator);
  out.pass.batch_statistics = Progress() < options.running_from;
  out.pass.dropout = options.dropout;
  out.pass.generator = &generator;
  Unroller unroller(networks, batch, window.first, options.history_noise, out.pass, generator);
  StepOptions how;
  // The critic sees motions as they are made at run time, where nobody knows the answer.
  how.present_share = options.config.HasArms() && !window.criticized ? options.present_share : 0.0;
  how.true_object_now = true;
  torch::Tensor loss = torch::zeros({});
  std::vector<torch::Tensor> seen;
  if (window.criticized) {
    const std::vector<torch::Tensor> truth = ActionCritic::TrueFrames(batch);
    out.true_motions =
        critic.Motions(ActionCritic::Blurred(truth, options.critic_blur_m, generator));
    seen.push_back(truth.front());
  }
  for (int step = 0; step < window.steps; ++step) {
    const TorchFrame frame = unroller.Predict(how);
    const StepLosses losses = unroller.Judge(frame, options.losses);
    loss = loss + losses.body_total;
    if (losses.arms_total.defined()) loss = loss + losses.arms_total;
    out.losses.Add(losses.values, share / window.steps);
    if (window.criticized) {
      seen.push_back(ActionCritic::Frame(frame.body.joints, frame.object.T, frame.object.R));
    }
    unroller.Advance(frame);
  }
  loss = loss * (share / window.steps);
  if (window.criticized) loss = loss + DoubtOf(seen, batch, share, out);
  out.gradients = torch::autograd::grad({loss}, optimizers[0].parameters, {}, false, false, true);
  out.pass.generator = nullptr;
}

Losses Trainer::Impl::StepTogether(nn::RandomStream& random) {
  const double lengthening =
      options.lengthen_until > 0.0 ? std::min(1.0, Progress() / options.lengthen_until) : 1.0;
  Window window;
  window.steps = std::min(kSteps, 1 + static_cast<int>(lengthening * kSteps));
  window.first = kHistory + static_cast<int>(random.Uniform() *
                                             static_cast<double>(kSteps - window.steps + 1));
  window.criticized =
      options.critic > 0.0 && window.steps == kSteps && Progress() >= options.critic_from;
  const std::vector<std::int64_t> rows = DrawRows();
  const int shards = std::max(1, static_cast<int>(rows.size()) / options.shard);
  std::vector<std::uint64_t> seeds(static_cast<std::size_t>(shards));
  for (std::uint64_t& seed : seeds) seed = random.Next();

  std::vector<Shard> done(static_cast<std::size_t>(shards));
  ParallelFor(shards, options.threads, [&](int k) {
    at::set_num_threads(1);
    const std::size_t begin = rows.size() * k / shards, end = rows.size() * (k + 1) / shards;
    const double share = static_cast<double>(end - begin) / static_cast<double>(rows.size());
    UnrollShard(data.Rows({rows.data() + begin, rows.data() + end}), share, window, seeds[k],
                done[k]);
  });

  OptimizerOf& optimizer = optimizers[0];
  Losses losses;
  for (std::size_t p = 0; p < optimizer.parameters.size(); ++p) {
    torch::Tensor sum;
    for (const Shard& shard : done) {
      const torch::Tensor& part = shard.gradients[p];
      if (part.defined()) sum = sum.defined() ? sum + part : part;
    }
    optimizer.parameters[p].mutable_grad() = sum;
  }
  std::vector<const Pass*> passes;
  for (const Shard& shard : done) {
    losses.Add(shard.losses, 1.0);
    passes.push_back(&shard.pass);
  }
  networks.TakeStatistics(passes);
  losses.gradient =
      torch::nn::utils::clip_grad_norm_(optimizer.parameters, options.largest_gradient);
  if (window.criticized) {
    std::vector<torch::Tensor> true_motions, own_motions, actions;
    for (const Shard& shard : done) {
      true_motions.push_back(shard.true_motions);
      own_motions.push_back(shard.own_motions);
      actions.push_back(shard.actions);
    }
    at::Generator generator = GeneratorOf(random);
    losses.critic = critic.Learn(torch::cat(true_motions), torch::cat(own_motions),
                                 torch::cat(actions), generator);
  }
  for (auto& group : optimizer.adam->param_groups()) group.options().set_lr(CosineRate());
  if (std::isfinite(losses.gradient)) optimizer.adam->step();
  return losses;
}

}  // namespace holdfast::imos
