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

/// Body joints over a motion (66 x T): one column per key frame, joint by joint (x, y, z), meters,
/// canonical frame. Joints 0 to 21 of SMPL-X.
using JointMotion = Eigen::MatrixXd;

inline constexpr int kMetricJoints = 22;

inline constexpr int kRecognizerFeatures = 128;  ///< size of the feature vector of a motion

/// Tensors of the recognition network with the names and shapes of the authors' PyTorch module:
/// lstm2_2 of (x, y) and lstm2_3 of (x, z) (`weight_ih_l0` 512 x 44 and so on, gates i, f, g, o),
/// conv1_2_2 and conv1_2_3 (1 x 1 x 3), hidden2label (29 x 128).
struct RecognizerWeights {
  nn::TensorMap tensors;
  std::map<std::string, std::string> notes;  ///< provenance
};

/// Weights from PyTorch's initial distribution.
RecognizerWeights RandomRecognizer(std::uint64_t seed);

/// Throws Error if the file is not a recognizer: missing names, other shapes, NaN.
RecognizerWeights ReadRecognizer(const std::filesystem::path& path);
void WriteRecognizer(const RecognizerWeights& weights, const std::filesystem::path& path);

/// Output of a recognizer for N motions.
struct Recognition {
  Eigen::MatrixXf logits;    ///< (29 x N); the network's scores are their sigmoids
  Eigen::MatrixXf features;  ///< (128 x N) 0.1 tanh(y)
  std::vector<int> labels;   ///< N: the action with the highest score
};

/// Classifies actions from joints, and computes the features for FID, diversity and multimodality
/// (the classifier of IMoS, Ghosh et al. 2023). Two LSTMs with two layers of 128 receive (x, y) and
/// (x, z) of the 22 joints in each key frame. A convolution runs along the last 128 outputs of
/// each. y is their sum, sigmoid(W y + b) the scores. Immutable and safe to share between threads.
class Recognizer {
 public:
  /// Throws Error (`where` names the file) as ReadRecognizer does.
  explicit Recognizer(const RecognizerWeights& weights, const std::string& where = "recognizer");

  /// Classifies motions of equal length. The result does not depend on `threads`; the result of a
  /// motion does not depend on the others. Throws Error for motions of different sizes or with
  /// non-finite coordinates.
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
