// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <torch/torch.h>

#include "generator/training/imos/imos_batch.h"
#include "generator/training/least_squares_critic.h"

namespace holdfast::imos {

/// Tells motions of the data from motions of the networks' own, action by action (least squares,
/// Mao et al. 2017; conditioned on labels as Reed et al. 2016 do, true motions under a wrong label
/// being wrong too; gradients at true ones kept small, Mescheder et al. 2018). A distance to the
/// one true motion makes networks give the mean of what may happen, which is nobody's drinking;
/// this asks only that it is drinking.
///
/// A motion is, from key frame k - 1 on: the joints, the object's translation and rotation (6D),
/// and the step of all that from each key frame to the next; each number of the mean 0 and
/// deviation 1 over the data.
class ActionCritic : public LeastSquaresCritic {
 public:
  static constexpr int kWidth = 192, kBlocks = 2;

  /// Mean and deviation are `data`'s.
  ActionCritic(const SequenceTensors& data, std::uint64_t seed);

  /// Key frames k - 1 .. 14 as numbers that Motions takes, (B x 75) each.
  static std::vector<torch::Tensor> TrueFrames(const SequenceTensors& batch);
  static torch::Tensor Frame(const torch::Tensor& joints, const torch::Tensor& object_T,
                             const torch::Tensor& object_R);
  /// The same with draws of N(0, blur_m^2) added to all positions (meters), and a tenth of a radian
  /// a centimeter to the rotation: what the tremor of a hand is cannot tell the two apart then.
  static std::vector<torch::Tensor> Blurred(std::vector<torch::Tensor> frames, double blur_m,
                                            at::Generator& generator);
  /// (B x 1725) of 12 key frames.
  torch::Tensor Motions(const std::vector<torch::Tensor>& frames) const;

  /// Mean over rows of (score - 1)^2 / 4 of the row's action (B): 0 for what is taken for true, 1
  /// for what is not.
  torch::Tensor Doubt(const torch::Tensor& motions, const torch::Tensor& actions) const;

  /// One step of its own learning, of true motions and the networks' own of the same actions;
  /// returns the share it judges rightly.
  double Learn(const torch::Tensor& true_motions, const torch::Tensor& own_motions,
               const torch::Tensor& actions, at::Generator& generator);

 private:
  torch::Tensor Scores(const torch::Tensor& motions, const torch::Tensor& actions) const;

  torch::Tensor mean_, deviation_;
  std::vector<std::int64_t> known_;  // actions of the data
};

}  // namespace holdfast::imos
