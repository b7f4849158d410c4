// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "generator/nn/column_network.h"
#include "generator/nn/network_weights.h"
#include "generator/wandr/intention.h"
#include "generator/wandr/statistics.h"
#include "geometry/io/container/safetensors.h"

namespace holdfast::wandr {

/// Weights of WANDR's conditional variational autoencoder as stored in a file (Diomataris et al.
/// 2024, sec. 3). Decoder: [z, c] -> normalized delta. Encoder: [normalized target delta, c] ->
/// [mu, logvar], for training only. Each is the published chain of layers or a residual network.
/// The blocks of a residual decoder receive all of z, those of a residual encoder none.
struct NetworkWeights {
  IntentionLayout layout = IntentionLayout::kPaper;
  nn::AnyWeights decoder;
  std::optional<nn::AnyWeights> encoder;
  Statistics statistics;
  /// Texts stored in the file: training options, training data, license.
  std::map<std::string, std::string> notes;

  int LatentSize() const { return nn::InputSize(decoder) - ConditionSize(layout); }
};

/// Reads a safetensors file: `decoder.layers.<i>.weight/bias` and `encoder....` named as in the
/// published checkpoint, or the names of residual networks (nn/network_weights.h),
/// `statistics.<feature>.mean/std`, and metadata "intention" (paper, flagged, bounded; default
/// paper). All other metadata become notes. Throws Error for missing, non-finite or wrongly shaped
/// tensors, another version, and inconsistent sizes.
NetworkWeights ReadNetwork(const std::filesystem::path& path);
NetworkWeights ReadNetwork(const SafetensorsReader& file, const std::string& where);

/// Writes such a file; `half` stores networks as float16, but not the statistics.
void WriteNetwork(const NetworkWeights& weights, const std::filesystem::path& path,
                  bool half = false);

/// A network converted from the authors' files.
struct ImportedNetwork {
  NetworkWeights weights;
  std::vector<std::string> ignored;  ///< other tensors of the checkpoint: the body model's
};

/// Reads the authors' checkpoint (a PyTorch Lightning file, whose `state_dict` has
/// `decoder.layers.<i>.weight/bias` and `encoder....`, maybe as members of a module) and their
/// statistics (.npy with a dict: feature -> {mean, std, ..}). Nothing in them is executed. The
/// intention is kPaper. Throws Error as ReadNetwork does, and for a file without these names.
ImportedNetwork ImportNetwork(const std::filesystem::path& checkpoint,
                              const std::filesystem::path& statistics);

/// A decoder prepared to run; immutable and safe to share between threads. Real is float; double is
/// for tests of derivatives and of float.
template <typename Real>
class Network {
 public:
  explicit Network(const NetworkWeights& weights, Isa isa = BestIsa());

  IntentionLayout Layout() const { return layout_; }
  int LatentSize() const { return latent_size_; }
  const Normalizer<Real>& Norms() const { return normalizer_; }
  const nn::ColumnNetwork<Real>& Decoder() const { return *decoder_; }

 private:
  IntentionLayout layout_;
  int latent_size_;
  Normalizer<Real> normalizer_;
  std::unique_ptr<const nn::ColumnNetwork<Real>> decoder_;
};

extern template class Network<float>;
extern template class Network<double>;

}  // namespace holdfast::wandr

namespace holdfast {

/// Weights of the reach generator and their origin.
struct ReachNetwork {
  std::string source;  ///< the file, or "embedded"
  wandr::NetworkWeights weights;
  std::string checksum;  ///< of weights and statistics; identifies the network
};

/// Reads the weights in a file, or the embedded ones if `path` is empty. Throws Error if there are
/// none.
ReachNetwork LoadReachNetwork(const std::string& path = {});

}  // namespace holdfast

namespace holdfast::wandr {

/// Returns whether the library has embedded trained weights (meshes/networks/wandr.safetensors).
bool HasDefaultNetwork();

/// Returns the embedded weights. Throws Error if there are none.
NetworkWeights DefaultNetwork();

}  // namespace holdfast::wandr
