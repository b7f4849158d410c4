// SPDX-License-Identifier: MIT
#include "generator/training/trainer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <dlfcn.h>
#include <fmt/format.h>

#include "generator/nn/any_weights.h"
#include "generator/training/motion_critic.h"
#include "generator/training/torch_network.h"
#include "geometry/error.h"
#include "geometry/io/safetensors.h"

namespace holdfast::wandr {
namespace {

constexpr int kWarmUp = 100;             // iterations
constexpr double kLastRate = 0.02;       // share of the learning rate that is left at the end
constexpr int kFewestStepsForPrior = 4;  // unrolled

// Free motions: goals this far along the ground and this high, metres; starts that stand or walk.
constexpr double kNearest = 0.25, kFarthest = 5.2, kHighest = 1.9;
constexpr float kLowestPelvis = 0.7f;
constexpr int kLongestFree = 240, kAfterDeadline = 8;  // frames
constexpr long kReferenceLasts = 500;                  // iterations
constexpr int kCriticEvery = 12;                       // frames
constexpr float kLargestBar = 3.0f;  // of one body's pose, where a metre of distance gives 1

// Sums of products that several threads share depend on how many there are.
void UseOneThreadForProducts() {
  at::set_num_threads(1);
  using SetThreads = void (*)(int);
  if (void* const set = dlsym(RTLD_DEFAULT, "openblas_set_num_threads")) {
    reinterpret_cast<SetThreads>(set)(1);
  }
}

nn::TensorMap WithoutPrefix(nn::TensorMap tensors) {
  nn::TensorMap plain;
  for (auto& [name, tensor] : tensors) plain[name.substr(4)] = std::move(tensor);
  return plain;
}

nn::TensorMap TensorsOf(const nn::AnyWeights& weights) {
  nn::TensorMap tensors;
  nn::AddTensors(weights, "net", tensors);
  return WithoutPrefix(std::move(tensors));
}

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

nn::TensorMap Prefixed(const nn::TensorMap& tensors, const std::string& prefix) {
  nn::TensorMap out;
  for (const auto& [name, tensor] : tensors) out[prefix + "." + name] = tensor;
  return out;
}

// The matrices of Eigen and the tensors of LibTorch over the same memory: columns are rows.
Eigen::Map<Eigen::MatrixXf> Columns(const torch::Tensor& tensor) {
  return {tensor.data_ptr<float>(), tensor.size(1), tensor.size(0)};
}

torch::Tensor Rho(const torch::Tensor& squared) {
  return 18.0 * (torch::sqrt(1.0 + squared / 9.0) - 1.0);
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
  return options;
}

struct Trainer::Impl {
  Impl(const Corpus& motions, const BoneOffsets<float>& bone_offsets, const TrainingOptions& given,
       const NetworkWeights* from)
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
                   std::max(given.free_bodies, 1), kLongestFree),
        optimizer(AllParameters(), torch::optim::AdamWOptions(given.learning_rate)
                                       .betas({0.9, 0.99})
                                       .weight_decay(given.weight_decay)) {}

  // As at run time: the goal stays, and is never nearer in time than a third of a second.
  static IntentionOptions FreeIntention(const TrainingOptions& options) {
    IntentionOptions intention = options.intention;
    intention.hold_last_goal = true;
    intention.min_frames_left = 10.0;
    return intention;
  }

  std::vector<torch::Tensor> AllParameters() const {
    std::vector<torch::Tensor> all = decoder.Parameters();
    const std::vector<torch::Tensor> more = encoder.Parameters();
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  double Progress() const {
    return static_cast<double>(iteration) / static_cast<double>(std::max(options.iterations, 1l));
  }

  // Few steps first; in the end all lengths up to the longest, each as often.
  int DrawSteps(nn::RandomStream& random) const {
    int longest = 1;
    for (double from = 0.01; 2 * longest <= options.longest_unroll && Progress() >= from;
         from *= 2.0) {
      longest *= 2;
    }
    const int kinds = static_cast<int>(std::lround(std::log2(longest))) + 1;
    return 1 << static_cast<int>(random.Uniform() * kinds);
  }

  void SetLearningRate() {
    double rate = options.learning_rate;
    rate *= std::min(1.0, static_cast<double>(iteration + 1) / kWarmUp);
    if (Progress() > options.decay_from) {
      const double left = (1.0 - Progress()) / (1.0 - options.decay_from);
      rate *= kLastRate + (1.0 - kLastRate) * left;
    }
    for (auto& group : optimizer.param_groups()) group.options().set_lr(rate);
  }

  // Block means of the deltas' errors, per row: translation, orientation, pose.
  std::array<torch::Tensor, 3> DeltaErrors(const torch::Tensor& deltas,
                                           const torch::Tensor& targets) const {
    torch::Tensor squared = (deltas - targets).square();
    if (options.robust) squared = Rho(squared);
    return {squared.narrow(1, 0, 3).mean(1), squared.narrow(1, 3, 6).mean(1),
            squared.narrow(1, 9, kStateSize - 9).mean(1)};
  }

  TrainingLosses Unroll(UnrolledBatch& bodies, int steps, int encoded, const TorchNetwork& decode,
                        const TorchNetwork& encode, bool learn);
  TrainingLosses UnrollFreely(int steps, nn::RandomStream& random);
  torch::Tensor TrueMoments(int count, nn::RandomStream& random);
  TrainingLosses Follow(nn::RandomStream& random);
  TrainingLosses GoFreely(nn::RandomStream& random);

  const Corpus& corpus;
  BoneOffsets<float> bones;
  TrainingOptions options;
  Statistics statistics;
  WindowSampler sampler;
  TorchNetwork decoder, encoder, mean_decoder, mean_encoder;
  std::optional<TorchNetwork> reference;  // the averaged decoder as it was a while ago
  long reference_since = 0;
  MotionCritic critic;
  UnrolledBatch batch, free_batch;
  torch::optim::AdamW optimizer;
  long iteration = 0;
};

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
    window.astray.setZero();
    windows.push_back(window);
  }
  UnrolledBatch bodies(statistics, bones, options.layout, options.intention, count, 1);
  bodies.Begin(windows, 1);
  const torch::Tensor condition = torch::empty({count, bodies.ConditionSize()});
  const torch::Tensor target = torch::empty({count, kStateSize});
  bodies.WriteInputs(0, Columns(condition), Columns(target), options.threads);
  return MotionCritic::Moments(condition, target);
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
    const double angle = 2.0 * M_PI * random.Uniform();
    const double early = 1.0 + options.goals.deadline_error * (random.Uniform() - 0.5);
    Waypoint goal;
    goal.position << pelvis.x() + distance * std::cos(angle),
        pelvis.y() + distance * std::sin(angle), kHighest * random.Uniform();
    goal.frame = static_cast<int>(std::lround(early * options.deadline.Frames(distance)));
    goal.frame = std::min(goal.frame, kLongestFree - kAfterDeadline);
    window.free = true;
    window.astray.setZero();
    window.plan = {goal};
    steps = std::max(steps, goal.frame + kAfterDeadline);
    windows.push_back(window);
  }
  free_batch.Begin(windows, steps);
  return UnrollFreely(steps, random);
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

long Trainer::Iteration() const { return impl_->iteration; }

TrainingLosses Trainer::Step() {
  Impl& s = *impl_;
  // Everything drawn in an iteration follows from the seed and its number: going on is exact.
  nn::RandomStream random(s.options.seed, static_cast<std::uint64_t>(s.iteration));
  torch::manual_seed(random.Next());
  s.SetLearningRate();
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
