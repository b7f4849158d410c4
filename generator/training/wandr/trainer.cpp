// SPDX-License-Identifier: MIT
#include "generator/training/wandr/trainer.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "generator/nn/network_weights.h"
#include "generator/training/network_tensors.h"
#include "generator/training/wandr/trainer_state.h"
#include "geometry/error.h"

namespace holdfast::wandr {
namespace {

constexpr int kWarmUp = 100;        // iterations
constexpr double kLastRate = 0.02;  // share of the learning rate that is left at the end

nn::TensorMap StartingTensors(const TrainingOptions& options, bool decoder) {
  const int condition = ConditionSize(options.layout), latent = options.latent_size;
  const int input = condition + (decoder ? latent : kStateSize);
  const int output = decoder ? kStateSize : 2 * latent;
  const std::uint64_t seed = 2 * options.seed + (decoder ? 0 : 1);
  if (!options.residual) {
    return TensorsOf(nn::RandomMlp(input, nn::TaperedWidths(input, output), output, seed));
  }
  const int blocks = decoder ? options.blocks : std::max(1, options.blocks / 2);
  return TensorsOf(
      nn::RandomResidual(input, decoder ? latent : 0, options.width, blocks, output, seed));
}

// As at run time: the goal stays, and is never nearer in time than a third of a second.
IntentionOptions FreeIntention(const TrainingOptions& options) {
  IntentionOptions intention = options.intention;
  intention.hold_last_goal = true;
  intention.min_frames_left = 10.0;
  return intention;
}

double LearningRate(const TrainingOptions& options, long iteration, double progress) {
  double rate = options.learning_rate * std::min(1.0, static_cast<double>(iteration + 1) / kWarmUp);
  if (progress > options.decay_from) {
    const double left = (1.0 - progress) / (1.0 - options.decay_from);
    rate *= kLastRate + (1.0 - kLastRate) * left;
  }
  return rate;
}

}  // namespace

TrainingOptions PaperOptions() {
  TrainingOptions options;
  options.residual = false;
  options.layout = IntentionLayout::kPaper;
  options.kl_weight = 0.01;
  options.free_bits = 0.05;
  options.robust = false;
  options.joints = {1.0f, 0.0f, 0.0f};
  options.spread = Spread::kAsPublished;
  options.dropout = 0.03;
  options.longest_unroll = 8;
  options.learning_rate = 1e-4;
  options.decay_from = 1.0;
  options.weight_decay = 0.0;
  options.prior_share = 0.0;
  options.free_from = 1.0;
  return options;
}
Trainer::Impl::Impl(const Corpus& motions, const BoneOffsets<float>& bone_offsets,
                    const TrainingOptions& given, const NetworkWeights* from)
    : corpus(motions),
      bones(bone_offsets),
      options(given),
      statistics(from ? from->statistics : motions.statistics),
      sampler(motions, bone_offsets, given.intention.wrist, given.goals),
      decoder(from ? TensorsOf(from->decoder) : StartingTensors(given, true)),
      encoder(from ? TensorsOf(*from->encoder) : StartingTensors(given, false)),
      mean_decoder(decoder.Frozen()),
      mean_encoder(encoder.Frozen()),
      critic(given.seed),
      batch(statistics, bone_offsets, given.layout, given.intention, given.frames_per_iteration,
            given.longest_unroll),
      free_batch(statistics, bone_offsets, given.layout, FreeIntention(given),
                 std::max(given.free_bodies, 1), kLongestFreeMotion),
      optimizer(AllParameters(), torch::optim::AdamWOptions(given.learning_rate)
                                     .betas({0.9, 0.99})
                                     .weight_decay(given.weight_decay)) {}

std::vector<torch::Tensor> Trainer::Impl::AllParameters() const {
  std::vector<torch::Tensor> all = decoder.Parameters();
  const std::vector<torch::Tensor> more = encoder.Parameters();
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

double Trainer::Impl::Progress() const {
  return static_cast<double>(iteration) / static_cast<double>(std::max(options.iterations, 1l));
}

Trainer::Trainer(const Corpus& corpus, const BoneOffsets<float>& bones,
                 const TrainingOptions& options, const NetworkWeights* from) {
  UseOneThreadForProducts();
  TrainingOptions mine = options;
  if (from) {
    if (!from->encoder) {
      throw Error("training", "the weights to begin with have no encoder",
                  "Give weights that 'holdfast train wandr' wrote");
    }
    mine.layout = from->layout;
    mine.latent_size = from->LatentSize();
    mine.residual = std::holds_alternative<nn::ResidualWeights>(from->decoder);
  }
  impl_ = std::make_unique<Impl>(corpus, bones, mine, from);
}

Trainer::~Trainer() = default;

const TrainingOptions& Trainer::Options() const { return impl_->options; }

long Trainer::Iteration() const { return impl_->iteration; }

TrainingLosses Trainer::Step() {
  Impl& s = *impl_;
  // Everything drawn in an iteration follows from the seed and its number: going on is exact.
  nn::RandomStream random(s.options.seed, static_cast<std::uint64_t>(s.iteration));
  torch::manual_seed(random.Next());
  const double learning_rate = LearningRate(s.options, s.iteration, s.Progress());
  for (auto& group : s.optimizer.param_groups()) group.options().set_lr(learning_rate);
  s.optimizer.zero_grad();
  const bool free = s.Progress() >= s.options.free_from && random.Uniform() < s.options.free_share;
  TrainingLosses losses = free ? s.GoFreely(random) : s.Follow(random);
  losses.gradient =
      torch::nn::utils::clip_grad_norm_(s.AllParameters(), s.options.largest_gradient);
  if (!std::isfinite(losses.total) || !std::isfinite(losses.gradient)) {
    throw Error("training", fmt::format("the loss is not finite at iteration {}", s.iteration),
                "Lower --learning-rate, and check the corpus with 'holdfast doctor'");
  }
  s.optimizer.step();
  ++s.iteration;
  // At first the average is that of the few iterations there are.
  const double rate = std::max(s.options.average_rate, 1.0 / (1.0 + s.iteration));
  s.mean_decoder.Follow(s.decoder, rate);
  s.mean_encoder.Follow(s.encoder, rate);
  return losses;
}

TrainingLosses Trainer::Validate(const Corpus& held_out) const {
  Impl& s = *impl_;
  const torch::NoGradGuard no_gradients;
  nn::RandomStream random(0, 0);
  torch::manual_seed(0);
  const WindowSampler sampler(held_out, s.bones, s.options.intention.wrist, s.options.goals);
  constexpr int kWindows = 512, kSteps = 4;
  std::vector<TrainingWindow> windows;
  for (int i = 0; i < kWindows; ++i) windows.push_back(sampler.Draw(kSteps, random));
  UnrolledBatch bodies(s.statistics, s.bones, s.options.layout, s.options.intention, kWindows,
                       kSteps);
  bodies.Begin(windows, kSteps);
  return s.Unroll(bodies, kSteps, kWindows, s.mean_decoder, s.mean_encoder, false);
}

NetworkWeights Trainer::Weights(bool with_encoder) const {
  const Impl& s = *impl_;
  NetworkWeights weights;
  weights.layout = s.options.layout;
  weights.statistics = s.statistics;
  weights.decoder =
      nn::AnyFromTensors(Prefixed(s.mean_decoder.Tensors(), "decoder"), "decoder", "training");
  if (with_encoder) {
    weights.encoder =
        nn::AnyFromTensors(Prefixed(s.mean_encoder.Tensors(), "encoder"), "encoder", "training");
  }
  return weights;
}

long Trainer::NumParameters() const {
  return impl_->decoder.NumParameters() + impl_->encoder.NumParameters();
}

}  // namespace holdfast::wandr
