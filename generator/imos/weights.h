// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/config.h"
#include "generator/nn/tensor.h"
#include "geometry/io/container/safetensors.h"

namespace holdfast::imos {

/// Weights of the IMoS networks as stored in a file: tensors named as in TensorsOf(config, ..),
/// with or without those used only in training.
struct NetworkWeights {
  Config config;
  nn::TensorMap tensors;
  /// Texts stored in the file: training options, training data, license.
  std::map<std::string, std::string> notes;

  bool HasPresentEncoder() const { return tensors.contains("arms.enc_bn1.weight"); }
  bool HasActionTable() const { return tensors.contains("action_embedding.weight"); }
};

/// Random weights with the published initialization: weights, biases and BatchNorm's scale and
/// shift ~ N(0, 0.02^2), running mean 0 and variance 1, LayerNorm gain 1 and offset 0, attention
/// matrices ~ N(0, 0.02^2); embeddings ~ N(0, 1). The same seed gives the same weights on every
/// platform.
NetworkWeights RandomNetwork(const Config& config, std::uint64_t seed, bool training = false);

/// Reads a safetensors file with the configuration and "format" "imos-1" in its metadata; all other
/// metadata become notes. Throws Error for another format or version, for missing, unknown, wrongly
/// shaped or non-finite tensors, negative running variances, and a partial present encoder.
NetworkWeights ReadNetwork(const std::filesystem::path& path);
NetworkWeights ReadNetwork(const SafetensorsReader& file, const std::string& where);

/// Writes the file atomically. `half` stores matrices as float16 (relative rounding error 5e-4);
/// vectors, which are small, keep their precision. Throws Error as CheckNetwork does.
void WriteNetwork(const NetworkWeights& weights, const std::filesystem::path& path,
                  bool half = false);

/// Throws Error unless the tensors are exactly those of the configuration, and finite.
void CheckNetwork(const NetworkWeights& weights, const std::string& where);

/// Returns the weights without the tensors used only in training.
NetworkWeights WithoutTraining(NetworkWeights weights);

/// Returns the embeddings of all actions (29 x E). Throws Error if they are external and the file
/// has none.
Eigen::MatrixXf ActionTable(const NetworkWeights& weights);

/// Reads action embeddings from a file (.npz, .safetensors, torch, JSON): an array of E numbers for
/// each of the 29 labels, or one array `embeddings` (29 x E) in their order, or other networks'
/// weights with such a table. Returns (29 x E). Throws Error for missing labels and other sizes.
Eigen::MatrixXf ReadActionTable(const std::filesystem::path& path, int action_size);

/// Returns E of such a file.
int ActionVectorSize(const std::filesystem::path& path);

/// The action whose vector is nearest to that of a sentence.
struct NearestAction {
  int action = 0;
  double cosine = 0.0;  ///< of the angle between the vectors
};

/// Compares the vector of `sentence`, an array of that name in such a file, with those of the
/// `offered` actions. Returns nothing if the file has no such array.
std::optional<NearestAction> FindNearestAction(const std::filesystem::path& path,
                                               const std::string& sentence,
                                               std::span<const std::string> offered);

/// Options that do not follow from the tensors of a checkpoint.
struct ImportWeightsOptions {
  /// The published weights have the arms as 17, 19, 21, 16, 18, 20; the published code trains them
  /// in ascending order.
  ArmOrder arm_order = ArmOrder::kRightThenLeft;
  ObjectRotation object_rotation = ObjectRotation::kRows;  ///< as in GRAB
  int attention_heads = 4;
  bool keep_training = false;  ///< keeps the present encoder
};

struct ImportedWeights {
  NetworkWeights weights;
  /// Tensors of the checkpoints that belong to no network here: buffers of body models, counters.
  std::vector<std::string> ignored;
};

/// Imports the published networks from two PyTorch checkpoints, the arms' and the body's. These are
/// files of torch.save with a state dictionary, alone or under `model_pose`, `state_dict` or
/// `model`, with or without the prefix `module.`. Sizes and the rest of the configuration follow
/// from tensor shapes. Nothing in the files is executed. Throws Error for other files, missing
/// tensors, and shapes that fit no configuration.
ImportedWeights ImportWeights(const std::filesystem::path& arms, const std::filesystem::path& body,
                              const ImportWeightsOptions& options);

}  // namespace holdfast::imos
