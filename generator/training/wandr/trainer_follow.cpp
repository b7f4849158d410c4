// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include "generator/training/network_tensors.h"
#include "generator/training/wandr/trainer_state.h"

namespace holdfast::wandr {
namespace {

constexpr int kFewestStepsForPrior = 4;  // unrolled

torch::Tensor Rho(const torch::Tensor& squared) {
  return 18.0 * (torch::sqrt(1.0 + squared / 9.0) - 1.0);
}

}  // namespace

// Few steps first; in the end all lengths up to the longest, each as often.
int Trainer::Impl::DrawSteps(nn::RandomStream& random) const {
  int longest = 1;
  for (double from = 0.01; 2 * longest <= options.longest_unroll && Progress() >= from;
       from *= 2.0) {
    longest *= 2;
  }
  const int kinds = static_cast<int>(std::lround(std::log2(longest))) + 1;
  return 1 << static_cast<int>(random.Uniform() * kinds);
}

std::array<torch::Tensor, 3> Trainer::Impl::DeltaErrors(const torch::Tensor& deltas,
                                                        const torch::Tensor& targets) const {
  torch::Tensor squared = (deltas - targets).square();
  if (options.robust) squared = Rho(squared);
  return {squared.narrow(1, 0, 3).mean(1), squared.narrow(1, 3, 6).mean(1),
          squared.narrow(1, 9, kStateSize - 9).mean(1)};
}

TrainingLosses Trainer::Impl::Unroll(UnrolledBatch& bodies, int steps, int encoded,
                                     const TorchNetwork& decode, const TorchNetwork& encode,
                                     bool learn) {
  const int count = bodies.NumBodies(), latent = options.latent_size;
  const Eigen::VectorXf weights =
      Eigen::VectorXf::Constant(count, 1.0f / static_cast<float>(count * steps));
  const double share = 1.0 / (count * steps), dropout = learn ? options.dropout : 0.0;
  TrainingLosses losses;
  std::vector<torch::Tensor> conditions, outputs, own_losses;
  for (int a = 0; a < steps; ++a) {
    torch::Tensor condition = torch::empty({count, bodies.ConditionSize()});
    torch::Tensor target = torch::empty({count, kStateSize});
    bodies.WriteInputs(a, Columns(condition), Columns(target), options.threads);
    condition.requires_grad_(learn);
    torch::Tensor z = torch::randn({count, latent});
    torch::Tensor own = torch::zeros({});
    if (encoded > 0) {
      const torch::Tensor seen = condition.narrow(0, 0, encoded);
      const torch::Tensor code =
          encode.Forward(torch::cat({target.narrow(0, 0, encoded), seen}, 1), dropout);
      const torch::Tensor mean = code.narrow(1, 0, latent);
      const torch::Tensor spread = code.narrow(1, latent, latent).clamp(-10.0, 4.0);
      const double factor = options.spread == Spread::kAsPublished ? 1.0 : 0.5;
      const torch::Tensor posterior = mean + z.narrow(0, 0, encoded) * torch::exp(factor * spread);
      z = encoded == count ? posterior
                           : torch::cat({posterior, z.narrow(0, encoded, count - encoded)});
      const torch::Tensor divergence = 0.5 * (mean.square() + spread.exp() - 1.0 - spread);
      losses.kl += divergence.mean().item<double>() / steps;
      own =
          options.kl_weight * share * torch::clamp_min(divergence, options.free_bits).mean(1).sum();
    }
    const torch::Tensor output = decode.Forward(torch::cat({z, condition}, 1), dropout);
    const auto errors = DeltaErrors(output, target);
    const torch::Tensor sums = torch::stack({errors[0].sum(), errors[1].sum(), errors[2].sum()});
    own = own + share * sums.sum();
    const torch::Tensor values = (share * sums).detach();
    losses.translation += values[0].item<double>();
    losses.orientation += values[1].item<double>();
    losses.pose += values[2].item<double>();
    losses.joints +=
        bodies.Advance(a, Columns(output.detach()), options.joints, weights, options.threads);
    losses.total += own.item<double>();
    if (!learn) continue;
    conditions.push_back(condition);
    outputs.push_back(output);
    own_losses.push_back(own);
  }
  losses.total += losses.joints;
  if (!learn) return losses;
  torch::Tensor output_bar = torch::empty({count, kStateSize});
  for (int a = steps - 1; a >= 0; --a) {
    bodies.OutputGradient(a, Columns(output_bar), options.threads);
    torch::autograd::backward({own_losses[a], outputs[a]}, {torch::ones({}), output_bar});
    if (a > 0) {
      bodies.ConditionGradient(a, Columns(conditions[a].grad()),
                               std::numeric_limits<float>::infinity(), options.threads);
    }
  }
  return losses;
}

TrainingLosses Trainer::Impl::Follow(nn::RandomStream& random) {
  const int steps = DrawSteps(random);
  const int count = std::max(1, options.frames_per_iteration / (steps == 1 ? 2 : steps));
  std::vector<TrainingWindow> windows;
  for (int i = 0; i < count; ++i) windows.push_back(sampler.Draw(steps, random));
  batch.Begin(windows, steps);
  const double prior = steps >= kFewestStepsForPrior ? options.prior_share : 0.0;
  const int encoded = count - static_cast<int>(std::lround(prior * count));
  return Unroll(batch, steps, encoded, decoder, encoder, true);
}

}  // namespace holdfast::wandr
