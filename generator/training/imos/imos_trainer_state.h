// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "generator/nn/random_stream.h"
#include "generator/training/imos/action_critic.h"
#include "generator/training/imos/imos_batch.h"
#include "generator/training/imos/imos_networks.h"
#include "generator/training/imos/imos_trainer.h"
#include "generator/training/imos/imos_unroll.h"

namespace holdfast::imos {

inline constexpr int kSteps = kNumKeyFrames - kHistory;  ///< of a whole motion

/// Lowers a learning rate when a loss no longer falls: torch's ReduceLROnPlateau with a relative
/// threshold.
struct PlateauSchedule {
  static constexpr double kFactor = 0.999, kThreshold = 0.05, kFloor = 2e-7;
  static constexpr int kWaitDiscount = 3;

  double rate = 0.0;
  double best = 1e300;
  int bad_epochs = 0;

  void Observe(double loss);
};

/// An optimizer, what it moves, and under which name it is kept.
struct OptimizerOf {
  std::string name;
  std::vector<torch::Tensor> parameters;
  std::unique_ptr<torch::optim::AdamW> adam;
  PlateauSchedule plateau;
  double epoch_loss = 0.0;  ///< sum over the epoch's batches so far

  OptimizerOf(std::string optimizer_name, std::vector<torch::Tensor> moved,
              const TrainingOptions& options);
  /// One step by the gradients of `loss`, clipped; returns their norm.
  double StepBy(const torch::Tensor& loss, double largest_gradient);
};

/// What a training has in hand. Private to imos_trainer*.cpp: LibTorch's headers stay there.
struct Trainer::Impl {
  Impl(const std::vector<ActionSequence>& given, const TrainingOptions& training_options,
       const Eigen::MatrixXf& embeddings);

  double Progress() const;
  long Epoch() const;
  /// Rows of the batch of this iteration: every epoch a permutation of its own.
  std::vector<std::int64_t> DrawRows() const;
  double CosineRate() const;

  Losses StepTogether(nn::RandomStream& random);
  /// Rows of a batch that are unrolled together, on one thread.
  struct Shard;
  /// What an iteration asks of all of them: windows of `steps` key frames from `first` on, whether
  /// whole motions are shown to the critic.
  struct Window {
    int first, steps;
    bool criticized;
  };
  void UnrollShard(SequenceTensors batch, double share, const Window& window, std::uint64_t seed,
                   Shard& out) const;
  /// What the critic doubts, weighed, a scalar.
  torch::Tensor DoubtOf(const std::vector<torch::Tensor>& frames, const SequenceTensors& batch,
                        double share, Shard& out) const;
  Losses StepAsPublished(nn::RandomStream& random);

  TrainingOptions options;
  SequenceTensors data;
  std::string fingerprint_of_data;
  TorchNetworks networks;
  ActionCritic critic;
  std::vector<OptimizerOf> optimizers;  ///< one; as published, the arms' and the body's
  long iteration = 0;
};

at::Generator GeneratorOf(nn::RandomStream& random);

}  // namespace holdfast::imos
