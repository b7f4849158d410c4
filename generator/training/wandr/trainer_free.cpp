// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numbers>

#include "generator/training/network_tensors.h"
#include "generator/training/wandr/trainer_state.h"

namespace holdfast::wandr {
namespace {

// Goals this far along the ground and this high, meters; starts that stand or walk.
constexpr double kNearest = 0.25, kFarthest = 5.2, kHighest = 1.9;
constexpr float kLowestPelvis = 0.7f;
constexpr int kAfterDeadline = 8;      // frames
constexpr long kReferenceLasts = 500;  // iterations
constexpr int kCriticEvery = 12;       // frames
constexpr float kLargestBar = 60.0f;   // of one body's pose, where a meter of distance gives 1

}  // namespace

TrainingLosses Trainer::Impl::UnrollFreely(int steps, nn::RandomStream& random) {
  UnrolledBatch& bodies = free_batch;
  const int count = bodies.NumBodies();
  const double share = options.anchor / (count * steps);
  TrainingLosses losses;
  losses.free = true;
  std::vector<torch::Tensor> conditions, outputs, own_losses, moments;
  torch::Tensor nothing = torch::empty({count, kStateSize});
  for (int a = 0; a < steps; ++a) {
    torch::Tensor condition = torch::empty({count, bodies.ConditionSize()});
    bodies.WriteInputs(a, Columns(condition), Columns(nothing), options.threads);
    condition.requires_grad_(true);
    const torch::Tensor x = torch::cat({torch::randn({count, options.latent_size}), condition}, 1);
    const torch::Tensor output = decoder.Forward(x);
    torch::Tensor before;
    {
      const torch::NoGradGuard no_gradients;
      before = reference->Forward(x);
    }
    const auto errors = DeltaErrors(output, before);
    const torch::Tensor sums = torch::stack({errors[0].sum(), errors[1].sum(), errors[2].sum()});
    torch::Tensor own = share * sums.sum();
    if (options.critic > 0.0) {
      const torch::Tensor moment = MotionCritic::Moments(condition, output);
      const torch::Tensor doubt = critic.Doubt(moment) / steps;
      losses.doubt += doubt.item<double>();
      own = own + options.critic * doubt;
      if (a % kCriticEvery == 0) moments.push_back(moment.detach());
    }
    const torch::Tensor values = (share * sums).detach();
    losses.translation += values[0].item<double>();
    losses.orientation += values[1].item<double>();
    losses.pose += values[2].item<double>();
    bodies.Advance(a, Columns(output.detach()), options.joints, Eigen::VectorXf::Zero(count),
                   options.threads);
    losses.total += own.item<double>();
    conditions.push_back(condition);
    outputs.push_back(output);
    own_losses.push_back(own);
  }
  const float weight = 1.0f / static_cast<float>(count);
  losses.goal = bodies.JudgeByGoals(options.goal_losses, options.standing, weight, options.threads);
  losses.total += losses.goal;
  torch::Tensor output_bar = torch::empty({count, kStateSize});
  for (int a = steps - 1; a >= 0; --a) {
    bodies.OutputGradient(a, Columns(output_bar), options.threads);
    torch::autograd::backward({own_losses[a], outputs[a]}, {torch::ones({}), output_bar});
    if (a > 0) {
      bodies.ConditionGradient(a, Columns(conditions[a].grad()), kLargestBar * weight,
                               options.threads);
    }
  }
  if (!moments.empty()) {
    const torch::Tensor own = torch::cat(moments);
    losses.critic = critic.Learn(TrueMoments(static_cast<int>(own.size(0)), random), own);
  }
  return losses;
}

torch::Tensor Trainer::Impl::TrueMoments(int count, nn::RandomStream& random) {
  std::vector<TrainingWindow> windows;
  while (static_cast<int>(windows.size()) < count) {
    TrainingWindow window = sampler.Draw(1, random);
    window.perturbation.setZero();
    windows.push_back(window);
  }
  UnrolledBatch bodies(statistics, bones, options.layout, options.intention, count, 1);
  bodies.Begin(windows, 1);
  const torch::Tensor condition = torch::empty({count, bodies.ConditionSize()});
  const torch::Tensor target = torch::empty({count, kStateSize});
  bodies.WriteInputs(0, Columns(condition), Columns(target), options.threads);
  return MotionCritic::Moments(condition, target);
}

TrainingLosses Trainer::Impl::GoFreely(nn::RandomStream& random) {
  if (!reference || iteration - reference_since >= kReferenceLasts) {
    reference = mean_decoder.Frozen();
    reference_since = iteration;
  }
  // Goals about as far from all, so that all take about as long.
  const double about = random.Uniform() * kFarthest;
  std::vector<TrainingWindow> windows;
  int steps = 1;
  while (static_cast<int>(windows.size()) < options.free_bodies) {
    TrainingWindow window = sampler.Draw(1, random);
    const Eigen::Vector3f pelvis = window.truth->translation + bones.offset.col(0);
    if (pelvis.z() < kLowestPelvis) continue;
    const double distance = std::clamp(about + 0.5 * (random.Uniform() - 0.5), kNearest, kFarthest);
    const double angle = 2.0 * std::numbers::pi * random.Uniform();
    const double early = 1.0 + options.goals.deadline_error * (random.Uniform() - 0.5);
    Waypoint goal;
    goal.position << pelvis.x() + distance * std::cos(angle),
        pelvis.y() + distance * std::sin(angle), kHighest * random.Uniform();
    goal.frame = static_cast<int>(std::lround(early * options.deadline.Frames(distance)));
    goal.frame = std::min(goal.frame, kLongestFreeMotion - kAfterDeadline);
    window.free = true;
    window.perturbation.setZero();
    window.plan = {goal};
    steps = std::max(steps, goal.frame + kAfterDeadline);
    windows.push_back(window);
  }
  free_batch.Begin(windows, steps);
  return UnrollFreely(steps, random);
}

}  // namespace holdfast::wandr
