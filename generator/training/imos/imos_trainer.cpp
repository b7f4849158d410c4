// SPDX-License-Identifier: MIT
#include "generator/training/imos/imos_trainer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <ATen/CPUGeneratorImpl.h>
#include <fmt/format.h>

#include "generator/imos/res_block.h"
#include "generator/training/imos/imos_trainer_state.h"
#include "generator/training/network_tensors.h"
#include "geometry/error.h"

namespace holdfast::imos {
namespace {

constexpr int kWarmUp = 50;         // iterations
constexpr double kLastRate = 0.01;  // share of the learning rate that is left at the end
// Of the start.
constexpr float kAttentionStart = 0.05f, kSkipStart = 0.05f, kRootStart = 0.005f,
                kStepStart = 0.02f, kOffset = 2.0f;
constexpr std::uint64_t kOrderStream = 0x0bde7;

void CheckOptions(const TrainingOptions& o) {
  const auto refuse = [](const std::string& what) {
    throw Error("training options", what, "Change the option");
  };
  CheckConfig(o.config, "training options");
  if (o.config.arm_order != ArmOrder::kAscending) refuse("arms are trained in ascending order");
  if (o.batch < 2) refuse(fmt::format("{} sequences a batch: batch norms need two", o.batch));
  if (o.shard < 2) refuse(fmt::format("{} sequences a shard: batch norms need two", o.shard));
  if (o.iterations < 1) refuse("no iterations");
}

// The tensors to begin with. Ours begin by standing still. Steps are small then; where the pose is
// made as it is, the last block of the body's decoder passes on the pose of the key frame before,
// which it is given after self-attention: (v - mean) / deviation over the pose's numbers, as long
// as that adds little. What is made passes two leaky ReLUs: the first is kept positive by an
// offset, and numbers that are always negative are made five times as large before the second.
nn::TensorMap Start(const TrainingOptions& options, const SequenceTensors& data,
                    const Eigen::MatrixXf& embeddings) {
  const Config& config = options.config;
  nn::TensorMap tensors = StartingTensors(config, options.as_published, options.seed, embeddings);
  if (options.as_published) return tensors;
  const auto values = [&](const std::string& name) -> std::vector<float>& {
    return tensors.find(name)->second.values;
  };
  for (int l = 0; config.self_attention && l < config.attention_layers; ++l) {
    for (float& w :
         values(fmt::format("body.attention_model.attention_layers.{}.attn.w_combine.weight", l))) {
      w *= kAttentionStart;
    }
  }
  const std::int64_t size = config.BodyPoseSize();
  const torch::Tensor poses = data.pose.narrow(2, 0, size).reshape({-1, size});
  const torch::Tensor mean = poses.mean(0), deviation = poses.std(0);
  float pose_mean = 0.0f, pose_deviation = 1.0f;
  if (config.self_attention) {
    pose_mean = poses.mean().item<float>();
    pose_deviation = poses.std(1, false).mean().item<float>();
  }
  std::vector<float>&shift = values("body.dec_rb2.bn2.bias"),
  &scale = values("body.dec_rb2.bn2.weight"), &skip = values("body.dec_rb2.fc3.weight"),
  &skip_bias = values("body.dec_rb2.fc3.bias");
  const std::size_t inputs = skip.size() / shift.size();
  const auto last_pose = static_cast<std::size_t>(config.body_latent + (kHistory - 1) * size);
  if (config.body_makes == BodyMakes::kStep) {
    for (float& w : skip) w *= kSkipStart;
    std::ranges::fill(scale, kStepStart);
    std::fill(scale.begin() + size, scale.end(), kRootStart);
    return tensors;
  }
  for (std::size_t i = 0; i < shift.size(); ++i) {
    float* const row = skip.data() + i * inputs;
    for (std::size_t c = 0; c < inputs; ++c) row[c] *= kSkipStart;
    if (i >= static_cast<std::size_t>(size)) {
      scale[i] = kRootStart;  // steps of millimeters
      continue;
    }
    const auto k = static_cast<std::int64_t>(i);
    // Larger where it may be positive, they would grow from key frame to key frame.
    const float spread = deviation[k].item<float>();
    const bool negative = mean[k].item<float>() < -2.0f * spread;
    const float gain = negative ? 1.0f / static_cast<float>(kLeakySlope) : 1.0f;
    scale[i] = 0.1f * gain * spread;
    row[last_pose + i] += gain * pose_deviation;
    skip_bias[i] = gain * (pose_mean + kOffset);
    shift[i] = -gain * kOffset;
  }
  return tensors;
}

// Everything that the data's values decide, in short.
std::string Fingerprint(const SequenceTensors& data) {
  return fmt::format("{} sequences {:.9g} {:.9g}", data.Count(),
                     data.pose.to(torch::kFloat64).sum().item<double>(),
                     data.object_T.to(torch::kFloat64).abs().sum().item<double>());
}

}  // namespace

TrainingOptions PaperOptions() {
  TrainingOptions options;
  options.config = PaperConfig();
  options.as_published = true;
  options.critic = 0.0;
  options.learning_rate = 5e-4;
  options.weight_decay = 0.0;
  options.dropout = 0.1;
  options.history_noise = 0.0;
  options.losses.joints = 1.0;
  options.losses.num_joints = kNumTrunkJoints;
  options.losses.wrists = 0.0;
  return options;
}

at::Generator GeneratorOf(nn::RandomStream& random) {
  return at::detail::createCPUGenerator(random.Next());
}

void PlateauSchedule::Observe(double loss) {
  if (loss < best * (1.0 - kThreshold)) {
    best = loss;
    bad_epochs = 0;
  } else if (++bad_epochs > kWaitDiscount) {
    rate = std::max(kFloor, rate * kFactor);
    bad_epochs = 0;
  }
}

OptimizerOf::OptimizerOf(std::string optimizer_name, std::vector<torch::Tensor> moved,
                         const TrainingOptions& options)
    : name(std::move(optimizer_name)),
      parameters(std::move(moved)),
      adam(std::make_unique<torch::optim::AdamW>(parameters,
                                                 torch::optim::AdamWOptions(options.learning_rate)
                                                     .betas({0.9, 0.999})
                                                     .weight_decay(options.weight_decay))) {
  plateau.rate = options.learning_rate;
}

double OptimizerOf::StepBy(const torch::Tensor& loss, double largest_gradient) {
  const std::vector<torch::Tensor> gradients =
      torch::autograd::grad({loss}, parameters, {}, false, false, true);
  for (std::size_t k = 0; k < parameters.size(); ++k) parameters[k].mutable_grad() = gradients[k];
  const double norm = torch::nn::utils::clip_grad_norm_(parameters, largest_gradient);
  adam->step();
  return norm;
}

Trainer::Impl::Impl(const std::vector<ActionSequence>& given,
                    const TrainingOptions& training_options, const Eigen::MatrixXf& embeddings)
    : options(training_options),
      data(TensorsOf(given)),
      fingerprint_of_data(Fingerprint(data)),
      networks(options.config, Start(options, data, embeddings), "training"),
      critic(data, options.seed) {
  options.batch = static_cast<int>(std::min<long>(options.batch, data.Count()));
  if (options.as_published && options.config.HasArms()) {
    optimizers.emplace_back("arms", networks.Parameters("arms."), options);
    optimizers.emplace_back("body", networks.Parameters("body."), options);
  } else {
    optimizers.emplace_back("all", networks.Parameters(), options);
  }
}

double Trainer::Impl::Progress() const {
  return static_cast<double>(iteration) / static_cast<double>(options.iterations);
}

long Trainer::Impl::Epoch() const { return iteration / (data.Count() / options.batch); }

std::vector<std::int64_t> Trainer::Impl::DrawRows() const {
  const long per_epoch = data.Count() / options.batch;
  std::vector<std::int64_t> order(static_cast<std::size_t>(data.Count()));
  std::iota(order.begin(), order.end(), 0);
  nn::RandomStream random(options.seed ^ kOrderStream, static_cast<std::uint64_t>(Epoch()));
  for (std::size_t k = order.size(); k > 1; --k) {
    std::swap(order[k - 1],
              order[static_cast<std::size_t>(random.Uniform() * static_cast<double>(k))]);
  }
  const auto begin = order.begin() + (iteration % per_epoch) * options.batch;
  return {begin, begin + options.batch};
}

double Trainer::Impl::CosineRate() const {
  const double warm = std::min(1.0, static_cast<double>(iteration + 1) / kWarmUp);
  const double fall = 0.5 * (1.0 + std::cos(std::numbers::pi * Progress()));
  return options.learning_rate * warm * (kLastRate + (1.0 - kLastRate) * fall);
}

Trainer::Trainer(const std::vector<ActionSequence>& sequences, const TrainingOptions& options,
                 const Eigen::MatrixXf& embeddings) {
  CheckOptions(options);
  if (sequences.size() < 2) {
    throw Error("training", fmt::format("{} sequence(s) to train on", sequences.size()),
                "Give two or more of subjects that are not held out");
  }
  if (embeddings.size() > 0 &&
      (embeddings.rows() != kNumActions || embeddings.cols() != options.config.action_size)) {
    throw Error("training",
                fmt::format("embeddings are {} x {}", embeddings.rows(), embeddings.cols()),
                fmt::format("{} x {} are needed", kNumActions, options.config.action_size));
  }
  wandr::UseOneThreadForProducts();
  impl_ = std::make_unique<Impl>(sequences, options, embeddings);
}

void Trainer::StartFrom(const NetworkWeights& weights, const std::string& where) {
  if (weights.config != impl_->options.config) {
    throw Error(where, "has another configuration than is trained",
                "Give the options it was made with");
  }
  const torch::NoGradGuard no_gradients;
  for (auto& [name, tensor] : impl_->networks.Named()) {
    const auto found = weights.tensors.find(name);
    if (found == weights.tensors.end() ||
        static_cast<std::int64_t>(found->second.values.size()) != tensor.numel()) {
      throw Error(where, fmt::format("has no '{}' of {} numbers", name, tensor.numel()),
                  "Give the best.safetensors of a training, not a file made smaller to be run");
    }
    std::ranges::copy(found->second.values, tensor.data_ptr<float>());
  }
}

Trainer::~Trainer() = default;

const TrainingOptions& Trainer::Options() const { return impl_->options; }

long Trainer::Iteration() const { return impl_->iteration; }

long Trainer::BatchesPerEpoch() const { return impl_->data.Count() / impl_->options.batch; }

double Trainer::LearningRate() const {
  return impl_->options.as_published ? impl_->optimizers.back().plateau.rate : impl_->CosineRate();
}

Losses Trainer::Step() {
  Impl& s = *impl_;
  // Everything drawn in an iteration follows from the seed and its number: going on is exact.
  nn::RandomStream random(s.options.seed, static_cast<std::uint64_t>(s.iteration));
  const Losses losses = s.options.as_published ? s.StepAsPublished(random) : s.StepTogether(random);
  if (!std::isfinite(losses.total) || !std::isfinite(losses.gradient)) {
    throw Error("training", fmt::format("the loss is not finite at iteration {}", s.iteration),
                "Lower --learning-rate, and check the clips with 'holdfast doctor'");
  }
  ++s.iteration;
  return losses;
}

RolloutErrors Trainer::Evaluate(const std::vector<ActionSequence>& sequences) const {
  const Impl& s = *impl_;
  RolloutErrors errors;
  if (sequences.empty()) return errors;
  const torch::NoGradGuard no_gradients;
  const SequenceTensors batch = TensorsOf(sequences);
  nn::RandomStream random(0, 0);
  at::Generator generator = GeneratorOf(random);
  Pass pass;
  Unroller unroller(s.networks, batch, kHistory, 0.0, pass, generator);
  const auto distance = [](const torch::Tensor& a, const torch::Tensor& b) {
    return torch::sqrt((a - b).pow(2).sum(-1));
  };
  const torch::Tensor still = batch.joints.select(1, kHistory - 1);
  for (int t = kHistory; t < kNumKeyFrames; ++t) {
    const TorchFrame frame = unroller.Predict({});
    unroller.Advance(frame);
    const torch::Tensor truth = batch.joints.select(1, t);
    const torch::Tensor joints = distance(frame.body.joints, truth);  // (B x 22)
    const torch::Tensor left = batch.by_left.select(1, t), right = batch.by_right.select(1, t);
    const torch::Tensor none = 0.5 * (1.0 - left - right);
    const double wrist = (joints.select(1, WristJoint(Side::kLeft)) * (left + none) +
                          joints.select(1, WristJoint(Side::kRight)) * (right + none))
                             .mean()
                             .item<double>();
    errors.mpjpe_m += joints.mean().item<double>() / kSteps;
    errors.wrists_m += wrist / kSteps;
    errors.last_wrist_m = wrist;
    errors.object_m +=
        distance(frame.object.T, batch.object_T.select(1, t)).mean().item<double>() / kSteps;
    errors.root_m +=
        distance(frame.transl, batch.transl.select(1, t)).mean().item<double>() / kSteps;
    errors.still_m += distance(still, truth).mean().item<double>() / kSteps;
  }
  return errors;
}

Eigen::MatrixXf Trainer::Rollout(const ActionSequence& sequence, bool sample) const {
  const torch::NoGradGuard no_gradients;
  const SequenceTensors batch = TensorsOf(std::span(&sequence, 1));
  nn::RandomStream random(0, 0);
  at::Generator generator = GeneratorOf(random);
  Pass pass;
  Unroller unroller(impl_->networks, batch, kHistory, 0.0, pass, generator);
  Eigen::MatrixXf joints = sequence.joints.cast<float>();
  StepOptions how;
  how.sample = sample;
  for (int t = kHistory; t < kNumKeyFrames; ++t) {
    const TorchFrame frame = unroller.Predict(how);
    const torch::Tensor row = frame.body.joints.contiguous();
    joints.col(t) = Eigen::Map<const Eigen::VectorXf>(row.data_ptr<float>(), row.numel());
    unroller.Advance(frame);
  }
  return joints;
}

NetworkWeights Trainer::Weights(bool with_training) const {
  NetworkWeights weights;
  weights.config = impl_->options.config;
  weights.tensors = impl_->networks.Tensors();
  return with_training ? weights : WithoutTraining(std::move(weights));
}

long Trainer::NumParameters() const { return impl_->networks.NumParameters(); }

}  // namespace holdfast::imos
