// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

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
  /// Texts kept in the file: how it was trained, on what, under which licence.
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

}  // namespace holdfast::imos
