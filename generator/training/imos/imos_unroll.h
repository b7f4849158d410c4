// SPDX-License-Identifier: MIT
#pragma once

#include <deque>

#include <torch/torch.h>

#include "generator/training/imos/imos_batch.h"
#include "generator/training/imos/imos_kinematics.h"
#include "generator/training/imos/imos_losses.h"
#include "generator/training/imos/imos_networks.h"

namespace holdfast::imos {

/// Where the k past key frames of a step come from, and what a step makes.
struct TorchFrame {
  torch::Tensor pose;    ///< (B x 132)
  torch::Tensor transl;  ///< (B x 3)
  TorchObject object;
  TorchBody body;
  torch::Tensor attended;  ///< (B x BodyPoseSize()), once it was needed
};

struct StepOptions {
  /// Share of rows whose arms are driven by the present encoder's latents, which know the answer;
  /// the others', as at run time, by the past encoder's. 0 runs no present encoder.
  double present_share = 0.0;
  bool sample = true;  ///< latents with their spread, or their mean
  /// The body synthesis sees true past arms and the true arms of the frame: as published, where the
  /// two modules are trained apart.
  bool true_arms = false;
  /// Where the configuration has the object "now" true in training: takes it.
  bool true_object_now = false;
};

/// A step's losses as tensors; `total` is weighed, the rest means.
struct StepLosses {
  torch::Tensor arms_total, body_total;  ///< of the modules; arms_total undefined with one
  Losses values;
};

/// The networks unrolled over a batch of sequences, from k true key frames on: step by step the
/// pose of key frame t, and the object where the predicted wrist carries it. Keeps gradients
/// through time unless told otherwise.
class Unroller {
 public:
  /// Begins before key frame `first` (4 .. 14), with the true ones `first` - 4 .. `first` - 1 as
  /// history, disturbed by N(0, noise^2) in 6D (a third of it, meters, in translations).
  Unroller(const TorchNetworks& networks, const SequenceTensors& batch, int first, double noise,
           Pass& pass, at::Generator& generator);

  int Frame() const { return t_; }
  /// phi of both modules again, after the weights have changed.
  void Refresh();
  /// Predicts key frame Frame(), and does not go on.
  TorchFrame Predict(const StepOptions& options);
  /// Losses of a prediction, from what Predict left.
  StepLosses Judge(const TorchFrame& predicted, const LossWeights& weights) const;
  /// Goes on with that key frame as the newest.
  void Advance(const TorchFrame& frame);
  /// The true key frame.
  TorchFrame Truth(int t) const;
  /// Puts the true key frames before Frame() in the history's place.
  void ForgetPredictions();

 private:
  torch::Tensor ObjectNumbers(const TorchObject& object, bool rotation) const;
  torch::Tensor Past(const torch::Tensor TorchFrame::*part, std::int64_t begin,
                     std::int64_t size) const;
  /// What latents of the size of `like` are drawn with.
  torch::Tensor Noise(const torch::Tensor& like, const StepOptions& options);
  /// How far the motion has come, (B x 1).
  torch::Tensor Progress() const;

  /// Arms as the body synthesis sees them.
  struct SeenArms {
    torch::Tensor past, now;  ///< `now` undefined without an arm synthesis
  };
  /// `past` are the arms of the history.
  void PredictArms(const torch::Tensor& past, const StepOptions& options);
  torch::Tensor ArmLatents(const torch::Tensor& input, const StepOptions& options);
  SeenArms ArmsSeen(const torch::Tensor& past, const StepOptions& options) const;
  torch::Tensor BodyInput(const SeenArms& arms, const StepOptions& options);

  const TorchNetworks& networks_;
  const Config& config_;
  const SequenceTensors& batch_;
  Pass& pass_;
  at::Generator& generator_;
  int t_;
  std::deque<TorchFrame> history_;
  torch::Tensor arms_phi_, body_phi_;
  // Of the last prediction.
  torch::Tensor divergence_arms_, divergence_body_, arms_, trunk_, root_step_;
};

}  // namespace holdfast::imos
