// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "generator/nn/random_stream.h"
#include "generator/training/wandr/corpus.h"
#include "generator/training/wandr/unrolled_batch.h"

namespace holdfast::wandr {

/// What share of windows has which goal; the rest of those with a labeled goal ahead keep it.
struct GoalMixture {
  double none = 0.1;        ///< no intention: with the flag 0 the network is a motion prior
  double hindsight = 0.15;  ///< where the wrist comes to in 0.5 to 8 s, drawn anew
  /// Deadlines far ahead are told wrongly by up to this share, early or late: at run time nobody
  /// knows how long the way takes.
  double deadline_error = 0.2;
  /// Share of windows with a perturbed start, by up to this angle per joint (standard deviation,
  /// drawn evenly from 0 on; half of it in the legs).
  double perturbed = 0.5;
  double perturbation_rad = 0.15;
  double captured = 0.2;  ///< share of windows from captured motion, if any is synthetic
};

/// Draws windows of a corpus, clips by their length, goals by the mixture. Clips without labeled
/// goals take hindsight ones in their stead.
class WindowSampler {
 public:
  /// `corpus` must outlive it.
  WindowSampler(const Corpus& corpus, const BoneOffsets<float>& bones, Side wrist,
                const GoalMixture& mixture);

  TrainingWindow Draw(int steps, nn::RandomStream& random) const;

 private:
  struct Group {
    std::vector<int> clips;
    std::vector<long> end;  // frames of clips up to and with this one
  };
  TangentVector<float> DrawPerturbation(nn::RandomStream& random) const;
  GoalPlan DrawGoals(const CorpusClip& clip, int frame, nn::RandomStream& random) const;

  const Corpus& corpus_;
  BoneOffsets<float> bones_;
  Side wrist_;
  GoalMixture mixture_;
  Group made_, captured_;
};

}  // namespace holdfast::wandr
