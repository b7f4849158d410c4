// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "generator/training/torch_network.h"
#include "generator/training/wandr/motion_critic.h"
#include "generator/training/wandr/trainer.h"

namespace holdfast::wandr {

inline constexpr int kLongestFreeMotion = 240;  ///< frames

/// What a training has in hand. Private to trainer*.cpp: LibTorch's headers stay there.
struct Trainer::Impl {
  Impl(const Corpus& motions, const BoneOffsets<float>& bone_offsets, const TrainingOptions& given,
       const NetworkWeights* from);

  std::vector<torch::Tensor> AllParameters() const;
  /// Share of the iterations done.
  double Progress() const;

  // trainer_follow.cpp: windows of the corpus, the truth to be followed.
  TrainingLosses Follow(nn::RandomStream& random);
  int DrawSteps(nn::RandomStream& random) const;
  TrainingLosses Unroll(UnrolledBatch& bodies, int steps, int encoded, const TorchNetwork& decode,
                        const TorchNetwork& encode, bool learn);
  /// Block means of the deltas' errors, per row: translation, orientation, pose.
  std::array<torch::Tensor, 3> DeltaErrors(const torch::Tensor& deltas,
                                           const torch::Tensor& targets) const;

  // trainer_free.cpp: whole motions of the network's own, judged by their goals.
  TrainingLosses GoFreely(nn::RandomStream& random);
  TrainingLosses UnrollFreely(int steps, nn::RandomStream& random);
  torch::Tensor TrueMoments(int count, nn::RandomStream& random);

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

}  // namespace holdfast::wandr
