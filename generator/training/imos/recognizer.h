// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "generator/imos/recognition.h"

namespace holdfast::imos {

/// Motions of one length and the actions they show.
struct LabeledMotions {
  std::vector<JointMotion> motions;
  std::vector<int> labels;
};

/// How the recognizer is trained. The defaults are this project's; PaperRecognizerOptions() are the
/// authors'.
struct RecognizerOptions {
  int batch = 16;
  int epochs = 300;
  double learning_rate = 2e-3;    ///< of Adam
  bool falling = true;            ///< it falls to 0 as a cosine over the epochs
  double largest_gradient = 1.0;  ///< norm that gradients are clipped to
  int patience = 60;              ///< epochs without a better validation; 0: never stops early
  /// Before so many steps it never stops: for some hundred the network knows nothing but how often
  /// each action is, and its loss does not fall.
  int least_steps = 2000;
  /// Learns from coordinates of mean 0 and deviation 1; the weights that come out take them as they
  /// are. Without, centimeters that tell one action from another hardly move the gates.
  bool standardize = true;
  /// Cross-entropy of the softmax over actions; without, binary cross-entropy of each action.
  bool softmax = true;
  /// Every motion is seen with all of each joint's positions shifted by a draw of this deviation,
  /// meters, and as a whole scaled by up to a tenth: how somebody stands is not what they do.
  double stance_m = 0.05;
  /// Every coordinate of every key frame is seen with a draw of this deviation added, meters: a
  /// centimeter more or less is not what tells actions apart.
  double jitter_m = 0.01;
  std::uint64_t seed = 1;
};

/// Batches of one, 500 epochs, rate 5e-4, binary cross-entropy, coordinates as they are, and no
/// early stop.
RecognizerOptions PaperRecognizerOptions();

/// After an epoch.
struct RecognizerEpoch {
  int epoch = 0;
  double training_loss = 0.0;    ///< cross-entropy, as options say
  double validation_loss = 0.0;  ///< NaN without motions to validate with
  double validation_accuracy = 0.0;
};

/// What was trained: the weights of the epoch with the highest validation accuracy, of those with
/// the lowest loss (which rises with confidence long before accuracy falls); without motions to
/// validate with, of the last one.
struct TrainedRecognizer {
  RecognizerWeights weights;
  RecognizerEpoch best;
  std::vector<RecognizerEpoch> epochs;
};

/// Trains. `validation` may be empty. `progress` sees each epoch and stops the training by
/// returning false. The same motions, options and seed give the same weights on one machine,
/// whatever the number of threads. Throws Error for no motions, of different sizes, or with labels
/// that are no actions.
TrainedRecognizer TrainRecognizer(const LabeledMotions& training, const LabeledMotions& validation,
                                  const RecognizerOptions& options,
                                  const std::function<bool(const RecognizerEpoch&)>& progress = {});

/// The recognizer in LibTorch.
class TorchRecognizer {
 public:
  explicit TorchRecognizer(const RecognizerWeights& weights);
  ~TorchRecognizer();
  TorchRecognizer(const TorchRecognizer&) = delete;
  TorchRecognizer& operator=(const TorchRecognizer&) = delete;

  /// Logits and features of a motion, as Recognizer gives them.
  Recognition Recognize(const std::vector<JointMotion>& motions) const;
  RecognizerWeights Weights() const;

 private:
  friend class RecognizerTraining;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace holdfast::imos
