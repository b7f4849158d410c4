// SPDX-License-Identifier: MIT
#include "generator/training/imos/recognizer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

#include <fmt/format.h>
#include <torch/torch.h>

#include "generator/nn/random_stream.h"
#include "generator/training/imos/motion_augmentation.h"
#include "generator/training/network_tensors.h"
#include "geometry/error.h"

namespace holdfast::imos {
namespace {

constexpr int kHidden = kRecognizerFeatures;

// A motion as the network was given it: (T x 66).
torch::Tensor RowsOf(const JointMotion& motion) {
  const Eigen::MatrixXf values = motion.cast<float>();
  return torch::from_blob(const_cast<float*>(values.data()), {values.cols(), values.rows()})
      .clone();
}

// (N x T x 66).
torch::Tensor BatchOf(const std::vector<JointMotion>& motions) {
  std::vector<torch::Tensor> rows;
  for (const JointMotion& motion : motions) rows.push_back(RowsOf(motion));
  return torch::stack(rows);
}

void Require(const LabeledMotions& set, const LabeledMotions& like) {
  if (set.labels.size() != set.motions.size()) {
    throw Error(
        "labels",
        fmt::format("{} of them stand against {} motions", set.labels.size(), set.motions.size()),
        "Give one of each motion");
  }
  for (std::size_t n = 0; n < set.motions.size(); ++n) {
    const JointMotion& motion = set.motions[n];
    if (motion.rows() != 3 * kMetricJoints || motion.cols() != like.motions[0].cols() ||
        motion.cols() < 1 || !motion.allFinite()) {
      throw Error(
          "motions",
          fmt::format("number {} is {} x {} or not finite; {} x {} is needed", n + 1, motion.rows(),
                      motion.cols(), 3 * kMetricJoints, like.motions[0].cols()),
          "Give the 22 joints of the body in every key frame");
    }
    if (set.labels[n] < 0 || set.labels[n] >= kNumActions) {
      throw Error("labels", fmt::format("{} is not an action", set.labels[n]),
                  fmt::format("Actions are 0 to {}", kNumActions - 1));
    }
  }
}

// (N x actions), 1 where the label is.
torch::Tensor OneHotActions(const std::vector<int>& labels) {
  const torch::Tensor targets =
      torch::zeros({static_cast<std::int64_t>(labels.size()), kNumActions});
  for (std::size_t n = 0; n < labels.size(); ++n) {
    targets[static_cast<std::int64_t>(n)][labels[n]] = 1.0f;
  }
  return targets;
}

bool Better(const RecognizerEpoch& a, const RecognizerEpoch& b) {
  return a.validation_accuracy > b.validation_accuracy ||
         (a.validation_accuracy == b.validation_accuracy && a.validation_loss < b.validation_loss);
}

}  // namespace

// Mean and deviation of each of the 66 coordinates over frames and motions.
struct RecognizerScale {
  torch::Tensor mean, deviation;

  RecognizerScale()
      : mean(torch::zeros({3 * kMetricJoints})), deviation(torch::ones({3 * kMetricJoints})) {}
  explicit RecognizerScale(const torch::Tensor& motions) {
    constexpr double kLeast_m = 0.01;  // what hardly moves is not blown up
    const torch::Tensor rows = motions.flatten(0, 1);
    mean = rows.mean(0);
    deviation = rows.std(0).clamp_min(kLeast_m);
  }
  torch::Tensor Standardized(const torch::Tensor& motions) const {
    return (motions - mean) / deviation;
  }
  // Weights for coordinates as they are from those for standardized ones.
  void FoldInto(RecognizerWeights& weights) const {
    for (int k = 0; k < 2; ++k) {
      const std::string lstm = k == 0 ? "lstm2_2" : "lstm2_3";
      nn::Tensor& matrix = weights.tensors.at(lstm + ".weight_ih_l0");
      nn::Tensor& bias = weights.tensors.at(lstm + ".bias_ih_l0");
      const std::size_t inputs = matrix.shape[1];
      for (std::size_t row = 0; row < matrix.shape[0]; ++row) {
        double moved = 0.0;
        for (std::size_t i = 0; i < inputs; ++i) {
          const auto coordinate = static_cast<std::int64_t>(3 * (i / 2) + (i % 2 == 0 ? 0 : 1 + k));
          float& weight = matrix.values[row * inputs + i];
          weight /= deviation[coordinate].item<float>();
          moved += static_cast<double>(weight) * mean[coordinate].item<double>();
        }
        bias.values[row] = static_cast<float>(bias.values[row] - moved);
      }
    }
  }
};

RecognizerOptions PaperRecognizerOptions() {
  RecognizerOptions options;
  options.batch = 1;
  options.epochs = 500;
  options.learning_rate = 5e-4;
  options.patience = 0;
  options.standardize = false;
  options.softmax = false;
  options.falling = false;
  options.stance_m = options.jitter_m = 0.0;
  return options;
}

struct TorchRecognizer::Impl {
  torch::nn::LSTM lstm[2]{{nullptr}, {nullptr}};
  torch::nn::Conv1d convolution[2]{{nullptr}, {nullptr}};
  torch::nn::Linear labels{nullptr};

  Impl() {
    const auto plane = torch::nn::LSTMOptions(2 * kMetricJoints, kHidden).num_layers(2);
    for (int k = 0; k < 2; ++k) {
      lstm[k] = torch::nn::LSTM(plane);
      convolution[k] = torch::nn::Conv1d(torch::nn::Conv1dOptions(1, 1, 3).padding(1));
    }
    labels = torch::nn::Linear(kHidden, kNumActions);
  }

  // By the names that weights files have them by.
  std::map<std::string, torch::Tensor> Parameters() const {
    std::map<std::string, torch::Tensor> all;
    const auto add = [&](const std::string& prefix, const torch::nn::Module& module) {
      for (const auto& item : module.named_parameters())
        all[prefix + "." + item.key()] = item.value();
    };
    for (int k = 0; k < 2; ++k) {
      add(k == 0 ? "lstm2_2" : "lstm2_3", *lstm[k]);
      add(k == 0 ? "conv1_2_2" : "conv1_2_3", *convolution[k]);
    }
    add("hidden2label", *labels);
    return all;
  }

  // y (N x 128) of motions (N x T x 66).
  torch::Tensor Forward(const torch::Tensor& motions) {
    const torch::Tensor points = motions.view({motions.size(0), motions.size(1), kMetricJoints, 3});
    torch::Tensor y;
    for (int k = 0; k < 2; ++k) {
      const torch::Tensor seen =
          points.index_select(3, torch::tensor({0L, k + 1L})).flatten(2).transpose(0, 1);
      const torch::Tensor last = std::get<0>(lstm[k]->forward(seen)).select(0, -1);
      const torch::Tensor out = convolution[k]->forward(last.unsqueeze(1)).squeeze(1);
      y = k == 0 ? out : y + out;
    }
    return y;
  }
};

TorchRecognizer::TorchRecognizer(const RecognizerWeights& weights)
    : impl_(std::make_unique<Impl>()) {
  static_cast<void>(Recognizer(weights));  // checks names and shapes
  const torch::NoGradGuard no_gradients;
  for (auto& [name, parameter] : impl_->Parameters()) {
    parameter.copy_(wandr::TorchTensorOf(weights.tensors.at(name)));
  }
}

TorchRecognizer::~TorchRecognizer() = default;

RecognizerWeights TorchRecognizer::Weights() const {
  RecognizerWeights weights;
  for (const auto& [name, parameter] : impl_->Parameters()) {
    weights.tensors[name] = wandr::TensorOf(parameter);
  }
  return weights;
}

Recognition TorchRecognizer::Recognize(const std::vector<JointMotion>& motions) const {
  const torch::NoGradGuard no_gradients;
  const torch::Tensor y = impl_->Forward(BatchOf(motions));
  const torch::Tensor logits = impl_->labels->forward(y).contiguous();
  const torch::Tensor features = (0.1 * torch::tanh(y)).contiguous();
  const auto columns = [](const torch::Tensor& rows) {
    return Eigen::MatrixXf(
        Eigen::Map<const Eigen::MatrixXf>(rows.data_ptr<float>(), rows.size(1), rows.size(0)));
  };
  Recognition result{columns(logits), columns(features), {}};
  const torch::Tensor best = logits.argmax(1);
  for (std::int64_t n = 0; n < best.size(0); ++n) {
    result.labels.push_back(static_cast<int>(best[n].item<std::int64_t>()));
  }
  return result;
}

// The network with its optimizer and the motions as it is shown them.
class RecognizerTraining {
 public:
  RecognizerTraining(const LabeledMotions& training, const LabeledMotions& validation,
                     const RecognizerOptions& options);

  TrainedRecognizer Run(const std::function<bool(const RecognizerEpoch&)>& progress);

 private:
  torch::Tensor Logits(const torch::Tensor& motions) const {
    return network_.impl_->labels->forward(network_.impl_->Forward(motions));
  }
  torch::Tensor Loss(const torch::Tensor& logits, const torch::Tensor& wanted) const {
    return options_.softmax ? torch::cross_entropy_loss(logits, wanted)
                            : torch::binary_cross_entropy_with_logits(logits, wanted);
  }
  void Shuffle(nn::RandomStream& random);
  void LowerRate(int epoch);
  // The motions with numbers `some`, as they are shown this time.
  torch::Tensor Shown(const torch::Tensor& some, nn::RandomStream& random) const;
  // One epoch of steps; the mean loss.
  double RunSteps(nn::RandomStream& random);
  void Validate(RecognizerEpoch& now) const;
  // Validation has not been better for as long as patience lasts.
  bool Stalls(int epoch, int best_epoch) const;

  const RecognizerOptions& options_;
  int count_;
  bool disturbed_, validates_;
  TorchRecognizer network_;
  std::vector<torch::Tensor> parameters_;
  std::unique_ptr<torch::optim::Adam> optimizer_;
  torch::Tensor motions_, targets_, validation_motions_, validation_targets_;
  RecognizerScale scale_;
  std::vector<std::int64_t> order_;
};

RecognizerTraining::RecognizerTraining(const LabeledMotions& training,
                                       const LabeledMotions& validation,
                                       const RecognizerOptions& options)
    : options_(options),
      count_(static_cast<int>(training.motions.size())),
      disturbed_(options.stance_m > 0.0 || options.jitter_m > 0.0),
      validates_(!validation.motions.empty()),
      network_(RandomRecognizer(options.seed)),
      order_(training.motions.size()) {
  for (const auto& [name, parameter] : network_.impl_->Parameters()) {
    parameters_.push_back(parameter);
  }
  optimizer_ = std::make_unique<torch::optim::Adam>(
      parameters_, torch::optim::AdamOptions(options.learning_rate));
  motions_ = BatchOf(training.motions);
  targets_ = OneHotActions(training.labels);
  if (options.standardize) scale_ = RecognizerScale(motions_);
  if (!disturbed_) motions_ = scale_.Standardized(motions_);
  if (validates_) {
    validation_motions_ = scale_.Standardized(BatchOf(validation.motions));
    validation_targets_ = OneHotActions(validation.labels);
  }
}

void RecognizerTraining::Shuffle(nn::RandomStream& random) {
  std::iota(order_.begin(), order_.end(), 0);
  for (int n = count_ - 1; n > 0; --n) {
    std::swap(order_[n], order_[static_cast<int>(random.Uniform() * (n + 1))]);
  }
}

void RecognizerTraining::LowerRate(int epoch) {
  const double way = std::numbers::pi * (epoch - 1) / options_.epochs;
  for (auto& group : optimizer_->param_groups()) {
    group.options().set_lr(0.5 * options_.learning_rate * (1.0 + std::cos(way)));
  }
}

torch::Tensor RecognizerTraining::Shown(const torch::Tensor& some, nn::RandomStream& random) const {
  torch::Tensor shown = motions_.index_select(0, some);
  if (options_.stance_m > 0.0) shown = InOtherStances(shown, options_.stance_m, random);
  if (options_.jitter_m > 0.0) shown = Jittered(shown, options_.jitter_m, random);
  if (disturbed_) shown = scale_.Standardized(shown);
  return shown;
}

double RecognizerTraining::RunSteps(nn::RandomStream& random) {
  double mean = 0.0;
  for (int first = 0; first < count_; first += options_.batch) {
    const int size = std::min(options_.batch, count_ - first);
    const torch::Tensor some = torch::tensor(
        std::vector<std::int64_t>(order_.begin() + first, order_.begin() + first + size));
    const torch::Tensor shown = Shown(some, random);
    optimizer_->zero_grad();
    const torch::Tensor loss = Loss(Logits(shown), targets_.index_select(0, some));
    loss.backward();
    torch::nn::utils::clip_grad_norm_(parameters_, options_.largest_gradient);
    optimizer_->step();
    mean += loss.item<double>() * size / count_;
  }
  return mean;
}

void RecognizerTraining::Validate(RecognizerEpoch& now) const {
  now.validation_loss = now.validation_accuracy = std::numeric_limits<double>::quiet_NaN();
  if (!validates_) return;
  const torch::NoGradGuard no_gradients;
  const torch::Tensor logits = Logits(validation_motions_);
  now.validation_loss = Loss(logits, validation_targets_).item<double>();
  now.validation_accuracy =
      logits.argmax(1).eq(validation_targets_.argmax(1)).to(torch::kFloat64).mean().item<double>();
}

bool RecognizerTraining::Stalls(int epoch, int best_epoch) const {
  const int steps = epoch * ((count_ + options_.batch - 1) / options_.batch);
  return validates_ && options_.patience > 0 && steps >= options_.least_steps &&
         epoch - best_epoch >= options_.patience;
}

TrainedRecognizer RecognizerTraining::Run(
    const std::function<bool(const RecognizerEpoch&)>& progress) {
  TrainedRecognizer result;
  for (int epoch = 1; epoch <= options_.epochs; ++epoch) {
    nn::RandomStream random(options_.seed, static_cast<std::uint64_t>(epoch));
    Shuffle(random);
    if (options_.falling) LowerRate(epoch);
    RecognizerEpoch now;
    now.epoch = epoch;
    now.training_loss = RunSteps(random);
    if (!std::isfinite(now.training_loss)) {
      throw Error("recognizer", fmt::format("its loss is no longer finite in epoch {}", epoch),
                  "Give a lower --learning-rate");
    }
    Validate(now);
    result.epochs.push_back(now);
    if (!validates_ || epoch == 1 || Better(now, result.best)) {
      result.best = now;
      result.weights = network_.Weights();
      scale_.FoldInto(result.weights);
    }
    if (progress && !progress(now)) break;
    if (Stalls(epoch, result.best.epoch)) break;
  }
  return result;
}

TrainedRecognizer TrainRecognizer(const LabeledMotions& training, const LabeledMotions& validation,
                                  const RecognizerOptions& options,
                                  const std::function<bool(const RecognizerEpoch&)>& progress) {
  if (training.motions.empty()) {
    throw Error("motions", "there are none to train with", "Give a folder of action clips");
  }
  Require(training, training);
  Require(validation, training);
  // Sums of many threads depend on their number: batches of this size have no work for two.
  torch::set_num_threads(1);
  return RecognizerTraining(training, validation, options).Run(progress);
}

}  // namespace holdfast::imos
