// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/vocabulary.h"
#include "generator/nn/packed_matrix.h"
#include "generator/nn/tensor.h"

namespace holdfast::imos {

/// Joints of the body along a motion (66 x T): a column per key frame, joint after joint (x, y, z),
/// meters, in the canonical frame. Joints 0 to 21 of SMPL-X.
using JointMotion = Eigen::MatrixXd;

inline constexpr int kMetricJoints = 22;

inline constexpr int kRecognizerFeatures = 128;  ///< numbers that stand for a motion

/// The recognition network's tensors, by the names and shapes that the authors' PyTorch module has
/// them by: lstm2_2 of (x, y) and lstm2_3 of (x, z) (`weight_ih_l0` 512 x 44 and so on, gates i, f,
/// g, o), conv1_2_2 and conv1_2_3 (1 x 1 x 3), hidden2label (29 x 128).
struct RecognizerWeights {
  nn::TensorMap tensors;
  std::map<std::string, std::string> notes;  ///< how they came about
};

/// PyTorch's initial distribution.
RecognizerWeights RandomRecognizer(std::uint64_t seed);

/// Throws Error for files that are no recognizer's: names missing, other shapes, NaN.
RecognizerWeights ReadRecognizer(const std::filesystem::path& path);
void WriteRecognizer(const RecognizerWeights& weights, const std::filesystem::path& path);

/// What a recognizer makes of N motions.
struct Recognition {
  Eigen::MatrixXf logits;    ///< (29 x N); the network's scores are their sigmoids
  Eigen::MatrixXf features;  ///< (128 x N) 0.1 tanh(y)
  std::vector<int> labels;   ///< N: the action of the highest score
};

/// Tells actions from joints, and gives the features that FID, diversity and multimodality are
/// measured with (the classifier of IMoS, Ghosh et al. 2023): two LSTMs of two layers of 128, one
/// sees (x, y) and one (x, z) of the 22 joints in each key frame; a convolution along each one's
/// last 128 outputs; y is their sum, sigmoid(W y + b) the scores. Const, shared by any number of
/// threads.
class Recognizer {
 public:
  /// Throws Error (`where` names the file) as ReadRecognizer does.
  explicit Recognizer(const RecognizerWeights& weights, const std::string& where = "recognizer");

  /// Of motions of one length. The result does not depend on `threads`, nor a motion's on what
  /// others there are. Throws Error for motions of other sizes or with coordinates that are not
  /// finite.
  Recognition Recognize(std::span<const JointMotion> motions, int threads = 1) const;

 private:
  // [W_input W_recurrent] of both layers, and the sums of their biases.
  struct Lstm {
    nn::PackedMatrix<float> matrices[2];
    Eigen::VectorXf biases[2];
    Eigen::Vector3f kernel;
    float kernel_bias = 0.0f;
  };
  static Lstm ReadLstm(const nn::TensorMap& tensors, const std::string& lstm,
                       const std::string& convolution, const std::string& where);
  // Adds the convolution of the last outputs to y. `steps` are the inputs (44 x n) of each frame.
  void Run(const Lstm& lstm, std::span<const Eigen::MatrixXf> steps, Eigen::MatrixXf& y) const;
  void RecognizeBlock(std::span<const JointMotion> motions, Eigen::Index first,
                      Recognition& result) const;

  const kernels::LayerLoops<float>* loops_;
  Lstm planes_[2];  // (x, y), (x, z)
  nn::PackedMatrix<float> labels_;
  Eigen::VectorXf labels_bias_;
};

}  // namespace holdfast::imos
