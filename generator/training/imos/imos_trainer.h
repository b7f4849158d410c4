// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "generator/imos/action_sequence.h"
#include "generator/imos/config.h"
#include "generator/imos/weights.h"
#include "generator/training/imos/imos_losses.h"
#include "generator/training/training_run.h"

namespace holdfast::imos {

/// How the networks are trained. The defaults are this project's; PaperOptions() the published
/// code's.
struct TrainingOptions {
  Config config = CompactConfig();
  LossWeights losses;

  /// As published: both modules by themselves, one step of Adam per key frame, its history taken as
  /// given (the truth for `true_history_epochs`, then their own predictions, but the truth again at
  /// key frame 9), objects where they truly are, the rate lowered when the loss stays. Ours: both
  /// modules together, unrolled as they are run and learning through all of it, with the object
  /// where the predicted wrist carries it.
  bool as_published = false;
  int true_history_epochs = 300;

  long iterations = 4000;  ///< batches
  int batch = 64;
  double learning_rate =
      5e-4;  ///< of Adam(W), 0.9, 0.999; ours is warmed up, then falls as a cosine
  double weight_decay = 1e-4;     ///< ours alone
  double largest_gradient = 1.0;  ///< norm that gradients are clipped to
  double dropout = 0.0;           ///< in blocks and attention, while batch statistics are used
  double present_share = 0.5;     ///< of rows (published: of calls) driven by the present encoder

  // Ours alone
  double history_noise = 0.02;  ///< N(0, s^2) in the true history's 6D; a third of it in meters
  /// N(0, s^2) on betas: there are few subjects, which must not be known by their shape.
  double shape_noise = 1.0;
  /// Of the rotations that DisturbStances puts into each sequence: nor by how they stand.
  double stance_noise_rad = 0.08;
  double lengthen_until = 0.5;  ///< share of the iterations in which windows grow from 1 to 11
  /// From this share of the iterations on, batch norms use the statistics that they will be run
  /// with, which stay; what is trained is then exactly what is run.
  double running_from = 0.15;
  /// Weight of what the critic doubts of whole motions, made as at run time (action_critic.h); 0
  /// has none.
  double critic = 0.06;
  /// From this share of the iterations on; the windows are whole then.
  double critic_from = 0.5;
  /// Noise in the motions that the critic sees, the data's and the networks', meters
  /// (ActionCritic::Blurred).
  double critic_blur_m = 0.01;
  int shard = 64;  ///< rows that are unrolled together, on one thread

  std::uint64_t seed = 1;
  int threads = 1;  ///< has no influence on the weights
};

TrainingOptions PaperOptions();

/// Errors of free rollouts against what truly happened, means over sequences and the 11 key frames
/// that are not given. Objects are carried rigidly by the wrists that truly carry them.
struct RolloutErrors {
  double mpjpe_m = 0.0;       ///< joints 0..21
  double wrists_m = 0.0;      ///< joint of the wrist that carries; both where none does
  double last_wrist_m = 0.0;  ///< the same in the last key frame
  double object_m = 0.0;      ///< the object's translation
  double root_m = 0.0;        ///< SMPL-X translation
  double still_m = 0.0;       ///< MPJPE of standing still from the last given key frame on

  static constexpr std::pair<const char*, double RolloutErrors::*> kParts[] = {
      {"mpjpe_m", &RolloutErrors::mpjpe_m},
      {"wrists_m", &RolloutErrors::wrists_m},
      {"last_wrist_m", &RolloutErrors::last_wrist_m},
      {"object_m", &RolloutErrors::object_m},
      {"root_m", &RolloutErrors::root_m},
      {"still_m", &RolloutErrors::still_m}};
};

/// Trains the networks of IMoS, batch by batch. The same sequences, options and seed give the same
/// weights on one machine whatever the number of threads, and after Save and Load.
class Trainer : public IterativeTrainer {
 public:
  /// `embeddings` (29 x E): given ones; empty to begin with random ones. Throws Error for no
  /// sequences, options that make no sense, and embeddings of another size.
  Trainer(const std::vector<ActionSequence>& sequences, const TrainingOptions& options,
          const Eigen::MatrixXf& embeddings = {});
  /// Begins with weights that were trained before, the present encoder's too, where none of Load's
  /// follow. Throws Error where they are of another configuration, or lack a tensor.
  void StartFrom(const NetworkWeights& weights, const std::string& where);
  ~Trainer() override;

  const TrainingOptions& Options() const;
  long Iteration() const override;
  /// Batches of an epoch: every sequence once, those left over after whole batches in other epochs.
  long BatchesPerEpoch() const;
  double LearningRate() const;
  /// One more batch; its mean losses. Throws Error when they are no longer finite.
  Losses Step();
  /// Free rollouts of the networks as they are run, one sample of latents each.
  RolloutErrors Evaluate(const std::vector<ActionSequence>& sequences) const;
  /// Joints (66 x 15) of one such rollout, the given key frames first.
  Eigen::MatrixXf Rollout(const ActionSequence& sequence, bool sample) const;

  NetworkWeights Weights(bool with_training) const;
  long NumParameters() const override;
  void Save(const std::filesystem::path& path) const override;
  void Load(const std::filesystem::path& path) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace holdfast::imos
