// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "generator/nn/column_network.h"
#include "generator/nn/network_weights.h"
#include "generator/wandr/intention.h"
#include "generator/wandr/statistics.h"
#include "geometry/io/container/safetensors.h"

namespace holdfast::wandr {

inline constexpr int kLatentSize = 64;  ///< of the published networks

/// WANDR's conditional variational auto-encoder as a file holds it (Diomataris et al. 2024, sec.
/// 3). Decoder: [z, c] -> normalized delta. Encoder: [normalized target delta, c] -> [mu, logvar],
/// for training and for encoding captured motion; files for use may leave it out. Either is the
/// published chain of layers or a residual network: a residual decoder's blocks see all of z, a
/// residual encoder's none.
struct NetworkWeights {
  IntentionLayout layout = IntentionLayout::kPaper;
  nn::AnyWeights decoder;
  std::optional<nn::AnyWeights> encoder;
  Statistics statistics;
  /// Texts kept in the file: how it was trained, on what, under which license.
  std::map<std::string, std::string> notes;

  int LatentSize() const { return nn::InputSize(decoder) - ConditionSize(layout); }
};

/// The published architecture with PyTorch's random start; `hidden` empty takes the paper's widths.
/// The same seed gives the same weights everywhere.
NetworkWeights RandomNetwork(IntentionLayout layout, std::uint64_t seed,
                             const Statistics& statistics = {}, int latent_size = kLatentSize,
                             const std::vector<int>& hidden = {});

/// The same of residual networks with `width` values between `blocks` blocks.
NetworkWeights RandomResidualNetwork(IntentionLayout layout, std::uint64_t seed,
                                     const Statistics& statistics, int latent_size, int width,
                                     int blocks);

/// Reads a safetensors file: `decoder.layers.<i>.weight/bias` and `encoder....` by the names of the
/// published checkpoint, or those of residual networks (nn/residual_weights.h),
/// `statistics.<feature>.mean/std`, and in its metadata "intention" (paper, flagged, bounded; paper
/// where it says nothing), every other text becoming a note. Throws Error for what is missing, of
/// another shape or version, or not finite, and for sizes that do not fit.
NetworkWeights ReadNetwork(const std::filesystem::path& path);
NetworkWeights ReadNetwork(const SafetensorsReader& file, const std::string& where);

/// Writes it, atomically; `half` stores float16 (training's rounding of 5e-4 relative).
void WriteNetwork(const NetworkWeights& weights, const std::filesystem::path& path,
                  bool half = false);

/// A network ready to run: const, shared by threads. Real is float; double is for tests of
/// derivatives and of float.
template <typename Real>
class Network {
 public:
  explicit Network(const NetworkWeights& weights, Isa isa = BestIsa());

  IntentionLayout Layout() const { return layout_; }
  int LatentSize() const { return latent_size_; }
  int ConditionSize() const { return wandr::ConditionSize(layout_); }
  const Normalizer<Real>& Norms() const { return normalizer_; }
  const nn::ColumnNetwork<Real>& Decoder() const { return *decoder_; }
  bool HasEncoder() const { return encoder_ != nullptr; }
  /// Throws Error when the file had none.
  const nn::ColumnNetwork<Real>& Encoder() const;

 private:
  IntentionLayout layout_;
  int latent_size_;
  Normalizer<Real> normalizer_;
  std::unique_ptr<const nn::ColumnNetwork<Real>> decoder_;
  std::unique_ptr<const nn::ColumnNetwork<Real>> encoder_;  // null where the file has none
};

/// How the encoder's logvar becomes a standard deviation. The published code samples with
/// exp(logvar) while its KL term takes exp(logvar) as the variance.
enum class Spread { kAsPublished, kFromVariance };

/// z = mu + eps * sigma, column by column; `code` (2 latent x N) is the encoder's output.
Eigen::MatrixXf SampleLatents(const Eigen::Ref<const Eigen::MatrixXf>& code,
                              const Eigen::Ref<const Eigen::MatrixXf>& eps, Spread spread);

extern template class Network<float>;
extern template class Network<double>;

}  // namespace holdfast::wandr
