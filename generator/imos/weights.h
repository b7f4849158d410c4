// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/imos/config.h"
#include "generator/nn/tensor.h"
#include "geometry/io/container/safetensors.h"

namespace holdfast::imos {

/// The networks of IMoS as a file holds them: tensors by the names of TensorsOf(config, ..), with
/// or without those for training alone.
struct NetworkWeights {
  Config config;
  nn::TensorMap tensors;
  /// Texts kept in the file: how it was trained, on what, under which license.
  std::map<std::string, std::string> notes;

  bool HasPresentEncoder() const { return tensors.contains("arms.enc_bn1.weight"); }
  bool HasActionTable() const { return tensors.contains("action_embedding.weight"); }
};

/// The published start: weights, biases and BatchNorm's scale and shift ~ N(0, 0.02^2), running
/// mean 0 and variance 1, LayerNorm gain 1 and offset 0, attention's matrices ~ N(0, 0.02^2);
/// embeddings ~ N(0, 1). The same seed gives the same weights everywhere.
NetworkWeights RandomNetwork(const Config& config, std::uint64_t seed, bool training = false);

/// Reads a safetensors file: the configuration in its metadata, "format" "imos-1", every other text
/// a note. Throws Error for another format or version, for tensors that are missing, unknown, of
/// another shape or not finite, negative running variances, and a present encoder in part.
NetworkWeights ReadNetwork(const std::filesystem::path& path);
NetworkWeights ReadNetwork(const SafetensorsReader& file, const std::string& where);

/// Writes it, atomically; `half` stores matrices as float16 (rounding of 5e-4 relative), vectors,
/// which are few, as they are. Throws Error as CheckNetwork does.
void WriteNetwork(const NetworkWeights& weights, const std::filesystem::path& path,
                  bool half = false);

/// Whether there are exactly the tensors of its configuration, finite: throws Error if not.
void CheckNetwork(const NetworkWeights& weights, const std::string& where);

/// The same without what only training needs.
NetworkWeights WithoutTraining(NetworkWeights weights);

/// The embeddings of all actions (29 x E). Throws Error when they are to be given from outside and
/// the file has none.
Eigen::MatrixXf ActionTable(const NetworkWeights& weights);

/// Embeddings by label that the user made: a file (.npz, .safetensors, torch, JSON) with an array
/// of E numbers for each of the 29 labels, or one array `embeddings` (29 x E) in their order, or
/// other networks' weights that have a table with them.
/// Returns (29 x E). Throws Error for missing labels and other sizes.
Eigen::MatrixXf ReadActionTable(const std::filesystem::path& path, int action_size);

/// What a checkpoint's tensors do not tell.
struct ImportWeightsOptions {
  /// The published weights have the arms as 17, 19, 21, 16, 18, 20; the published code trains them
  /// ascending.
  ArmOrder arm_order = ArmOrder::kRightThenLeft;
  ObjectRotation object_rotation = ObjectRotation::kRows;  ///< as GRAB has it
  int attention_heads = 4;
  bool keep_training = false;  ///< keeps the present encoder
};

struct ImportedWeights {
  NetworkWeights weights;
  /// Tensors of the checkpoints that no network here has: body models' buffers, counters.
  std::vector<std::string> ignored;
};

/// The published networks from two PyTorch checkpoints, the arms' and the body's: files that
/// torch.save wrote, of a state by names, alone or under `model_pose` or `state_dict`, with or
/// without a `module.` before every name. Sizes and the rest of the configuration follow from the
/// tensors' shapes. Nothing in the files is executed. Throws Error for what is no such file, for
/// missing tensors, and for shapes that fit no configuration.
ImportedWeights ImportWeights(const std::filesystem::path& arms, const std::filesystem::path& body,
                              const ImportWeightsOptions& options);

}  // namespace holdfast::imos
