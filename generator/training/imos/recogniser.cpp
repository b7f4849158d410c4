// SPDX-License-Identifier: MIT
#include "generator/training/imos/recogniser.h"

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
#include "geometry/error.h"

namespace holdfast::imos {
namespace {

constexpr int kHidden = kRecogniserFeatures;

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

void Require(const LabelledMotions& set, const LabelledMotions& like) {
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
      throw Error("labels", fmt::format("{} is no action", set.labels[n]),
                  fmt::format("Actions are 0 to {}", kNumActions - 1));
    }
  }
}

// Mean and deviation of each of the 66 coordinates over frames and motions.
struct Scale {
  torch::Tensor mean, deviation;

  Scale() : mean(torch::zeros({3 * kMetricJoints})), deviation(torch::ones({3 * kMetricJoints})) {}
  explicit Scale(const torch::Tensor& motions) {
    constexpr double kLeast_m = 0.01;  // what hardly moves is not blown up
    const torch::Tensor rows = motions.flatten(0, 1);
    mean = rows.mean(0);
    deviation = rows.std(0).clamp_min(kLeast_m);
  }
  torch::Tensor Standardised(const torch::Tensor& motions) const {
    return (motions - mean) / deviation;
  }
  // Weights for coordinates as they are from those for standardised ones.
  void FoldInto(RecogniserWeights& weights) const {
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

}  // namespace

RecogniserOptions PaperRecogniserOptions() {
  RecogniserOptions options;
  options.batch = 1;
  options.epochs = 500;
  options.learning_rate = 5e-4;
  options.patience = 0;
  options.standardise = false;
  options.softmax = false;
  options.falling = false;
  options.stance_m = options.jitter_m = 0.0;
  return options;
}

struct TorchRecogniser::Impl {
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

TorchRecogniser::TorchRecogniser(const RecogniserWeights& weights)
    : impl_(std::make_unique<Impl>()) {
  static_cast<void>(Recogniser(weights));  // checks names and shapes
  const torch::NoGradGuard no_gradients;
  for (auto& [name, parameter] : impl_->Parameters()) {
    const nn::Tensor& tensor = weights.tensors.at(name);
    parameter.copy_(torch::from_blob(const_cast<float*>(tensor.values.data()), parameter.sizes()));
  }
}

TorchRecogniser::~TorchRecogniser() = default;

RecogniserWeights TorchRecogniser::Weights() const {
  RecogniserWeights weights;
  for (const auto& [name, parameter] : impl_->Parameters()) {
    const torch::Tensor values = parameter.detach().contiguous();
    nn::Tensor& tensor = weights.tensors[name];
    for (const auto length : values.sizes()) {
      tensor.shape.push_back(static_cast<std::size_t>(length));
    }
    tensor.values.assign(values.data_ptr<float>(), values.data_ptr<float>() + values.numel());
  }
  return weights;
}

Recognition TorchRecogniser::Recognise(const std::vector<JointMotion>& motions) const {
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

TrainedRecogniser TrainRecogniser(const LabelledMotions& training,
                                  const LabelledMotions& validation,
                                  const RecogniserOptions& options,
                                  const std::function<bool(const RecogniserEpoch&)>& progress) {
  if (training.motions.empty()) {
    throw Error("motions", "there are none to train with", "Give a folder of action clips");
  }
  Require(training, training);
  Require(validation, training);
  // Sums of many threads depend on their number: batches of this size have no work for two.
  torch::set_num_threads(1);
  TorchRecogniser network(RandomRecogniser(options.seed));
  std::vector<torch::Tensor> parameters;
  for (const auto& [name, parameter] : network.impl_->Parameters()) parameters.push_back(parameter);
  torch::optim::Adam optimizer(parameters, torch::optim::AdamOptions(options.learning_rate));

  const auto one_hot = [](const std::vector<int>& labels) {
    const torch::Tensor targets =
        torch::zeros({static_cast<std::int64_t>(labels.size()), kNumActions});
    for (std::size_t n = 0; n < labels.size(); ++n) {
      targets[static_cast<std::int64_t>(n)][labels[n]] = 1.0f;
    }
    return targets;
  };
  torch::Tensor motions = BatchOf(training.motions);
  const torch::Tensor targets = one_hot(training.labels);
  const Scale scale = options.standardise ? Scale(motions) : Scale();
  const bool disturbed = options.stance_m > 0.0 || options.jitter_m > 0.0;
  if (!disturbed) motions = scale.Standardised(motions);
  const bool validates = !validation.motions.empty();
  torch::Tensor validation_motions, validation_targets;
  if (validates) {
    validation_motions = scale.Standardised(BatchOf(validation.motions));
    validation_targets = one_hot(validation.labels);
  }
  const auto logits_of = [&](const torch::Tensor& some) {
    return network.impl_->labels->forward(network.impl_->Forward(some));
  };
  const auto loss_of = [&](const torch::Tensor& logits, const torch::Tensor& wanted) {
    return options.softmax ? torch::cross_entropy_loss(logits, wanted)
                           : torch::binary_cross_entropy_with_logits(logits, wanted);
  };

  TrainedRecogniser result;
  const auto count = static_cast<int>(training.motions.size());
  std::vector<std::int64_t> order(count);
  for (int epoch = 1; epoch <= options.epochs; ++epoch) {
    std::iota(order.begin(), order.end(), 0);
    nn::RandomStream random(options.seed, static_cast<std::uint64_t>(epoch));
    for (int n = count - 1; n > 0; --n) {
      std::swap(order[n], order[static_cast<int>(random.Uniform() * (n + 1))]);
    }
    if (options.falling) {
      const double way = std::numbers::pi * (epoch - 1) / options.epochs;
      for (auto& group : optimizer.param_groups()) {
        group.options().set_lr(0.5 * options.learning_rate * (1.0 + std::cos(way)));
      }
    }
    RecogniserEpoch now;
    now.epoch = epoch;
    for (int first = 0; first < count; first += options.batch) {
      const int size = std::min(options.batch, count - first);
      const torch::Tensor some = torch::tensor(
          std::vector<std::int64_t>(order.begin() + first, order.begin() + first + size));
      torch::Tensor shown = motions.index_select(0, some);
      if (options.stance_m > 0.0) shown = InOtherStances(shown, options.stance_m, random);
      if (options.jitter_m > 0.0) shown = Jittered(shown, options.jitter_m, random);
      if (disturbed) shown = scale.Standardised(shown);
      optimizer.zero_grad();
      const torch::Tensor loss = loss_of(logits_of(shown), targets.index_select(0, some));
      loss.backward();
      torch::nn::utils::clip_grad_norm_(parameters, options.largest_gradient);
      optimizer.step();
      now.training_loss += loss.item<double>() * size / count;
    }
    if (!std::isfinite(now.training_loss)) {
      throw Error("recogniser", fmt::format("its loss is no longer finite in epoch {}", epoch),
                  "Give a lower --learning-rate");
    }
    now.validation_loss = now.validation_accuracy = std::numeric_limits<double>::quiet_NaN();
    if (validates) {
      const torch::NoGradGuard no_gradients;
      const torch::Tensor logits = logits_of(validation_motions);
      now.validation_loss = loss_of(logits, validation_targets).item<double>();
      now.validation_accuracy = logits.argmax(1)
                                    .eq(validation_targets.argmax(1))
                                    .to(torch::kFloat64)
                                    .mean()
                                    .item<double>();
    }
    result.epochs.push_back(now);
    const bool better = now.validation_accuracy > result.best.validation_accuracy ||
                        (now.validation_accuracy == result.best.validation_accuracy &&
                         now.validation_loss < result.best.validation_loss);
    if (!validates || epoch == 1 || better) {
      result.best = now;
      result.weights = network.Weights();
      scale.FoldInto(result.weights);
    }
    if (progress && !progress(now)) break;
    const int steps = epoch * ((count + options.batch - 1) / options.batch);
    if (validates && options.patience > 0 && steps >= options.least_steps &&
        epoch - result.best.epoch >= options.patience) {
      break;
    }
  }
  return result;
}

}  // namespace holdfast::imos
