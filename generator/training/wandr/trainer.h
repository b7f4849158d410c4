// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "generator/training/training_run.h"
#include "generator/training/wandr/corpus.h"
#include "generator/training/wandr/unrolled_batch.h"
#include "generator/training/wandr/window_sampler.h"
#include "generator/wandr/network.h"

namespace holdfast::wandr {

/// How a network is trained. The defaults are this project's; PaperOptions() the paper's.
struct TrainingOptions {
  // The network
  bool residual = true;  ///< or the published plain chain
  int width = 256;       ///< of a residual network
  int blocks = 4;
  int latent_size = kLatentSize;
  IntentionLayout layout = IntentionLayout::kBounded;
  IntentionOptions intention;

  // The loss
  double kl_weight = 0.5;   ///< alpha, of the mean over latents
  double free_bits = 0.02;  ///< least KL of a latent
  bool robust = true;       ///< rho(e) = 18 (sqrt(1 + e / 9) - 1) in place of e
  JointLossWeights joints;
  Spread spread = Spread::kFromVariance;
  double dropout = 0.0;  ///< of plain networks
  /// From 4 unrolled steps on, this share of bodies is driven by latents of N(0, 1) in place of the
  /// encoder's, and judged by the same losses at full weight: otherwise the encoder's latents tell
  /// the decoder the next frame, and it need not look at the goal.
  double prior_share = 0.5;
  GoalMixture goals;

  // Left to itself: whole motions from prior latents to drawn goals, judged by whether they get
  // there (goal_loss.h) and by how far they stray from what the network did before it was so asked.
  double free_from = 0.5;   ///< share of the iterations after which this begins
  double free_share = 0.5;  ///< of the iterations from there on
  int free_bodies = 64;
  double anchor = 1.0;  ///< weight of straying: the deltas' error against the earlier network
  double critic = 1.0;  ///< weight of looking made up to a critic (motion_critic.h), per motion
  GoalLossWeights goal_losses;
  FootHeights standing;  ///< of the body that is trained
  DeadlineRule deadline;

  // The schedule
  long iterations = 6000;
  int frames_per_iteration = 4096;  ///< bodies times unrolled steps
  int longest_unroll = 16;          ///< a power of two; reached after a tenth of the iterations
  double learning_rate = 6e-4;      ///< of AdamW (0.9, 0.99), warmed up, falling linearly ...
  double decay_from = 0.3;          ///< ... from this share of the iterations on
  double weight_decay = 1e-4;
  double largest_gradient = 1.0;  ///< norm that gradients are clipped to
  double average_rate = 0.004;    ///< of the running average of the weights, which is what is kept
  std::uint64_t seed = 1;
  int threads = 1;
};

/// The published training (wandr.md of the paper's code): plain networks, paper's features, mean
/// squares, KL weight 0.01 with free bits 0.05, unrolled up to 8 of its 10 steps.
TrainingOptions PaperOptions();

/// Means over what was trained since the last report.
struct TrainingLosses {
  double translation = 0.0, orientation = 0.0, pose = 0.0;  ///< normalized deltas, block means
  double kl = 0.0;
  double joints = 0.0;
  double goal = 0.0;    ///< of free motions; translation, orientation and pose are straying then
  double doubt = 0.0;   ///< of the critic about free motions: 0 none, 1 to be sure
  double critic = 0.0;  ///< share that the critic judges rightly
  bool free = false;
  double total = 0.0;
  double gradient = 0.0;  ///< norm, before it is clipped

  static constexpr std::pair<const char*, double TrainingLosses::*> kParts[] = {
      {"translation", &TrainingLosses::translation},
      {"orientation", &TrainingLosses::orientation},
      {"pose", &TrainingLosses::pose},
      {"kl", &TrainingLosses::kl},
      {"joints", &TrainingLosses::joints},
      {"goal", &TrainingLosses::goal},
      {"doubt", &TrainingLosses::doubt},
      {"critic", &TrainingLosses::critic},
      {"total", &TrainingLosses::total},
      {"gradient", &TrainingLosses::gradient}};
};

/// Trains encoder and decoder, iteration by iteration. The same corpus, options and seed give the
/// same weights on one machine whatever the number of threads, and after Save and Load.
class Trainer : public IterativeTrainer {
 public:
  /// `corpus` must outlive it. With `from`, begins with those weights and their statistics; the
  /// network's sizes are then theirs. Throws Error when they have no encoder.
  Trainer(const Corpus& corpus, const BoneOffsets<float>& bones, const TrainingOptions& options,
          const NetworkWeights* from = nullptr);
  ~Trainer() override;

  const TrainingOptions& Options() const;
  long Iteration() const override;
  /// One more; returns its losses. Throws Error when they are no longer finite.
  TrainingLosses Step();
  /// Losses of the averaged weights on clips not trained on, teacher-forced, latents encoded.
  TrainingLosses Validate(const Corpus& held_out) const;

  /// The running average of the weights.
  NetworkWeights Weights(bool with_encoder) const;
  long NumParameters() const override;
  void Save(const std::filesystem::path& path) const override;
  void Load(const std::filesystem::path& path) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace holdfast::wandr
