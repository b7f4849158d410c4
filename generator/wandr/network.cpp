// SPDX-License-Identifier: MIT
#include "generator/wandr/network.h"

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/safetensors.h"

namespace holdfast::wandr {
namespace {

constexpr const char* kFormat = "wandr-1";
constexpr const char* kRemedy = "Give weights that 'holdfast.train wandr' wrote, or converted ones";

constexpr std::array<std::pair<IntentionLayout, std::string_view>, 3> kLayoutNames{
    {{IntentionLayout::kPaper, "paper"},
     {IntentionLayout::kFlagged, "flagged"},
     {IntentionLayout::kBounded, "bounded"}}};

IntentionLayout LayoutOf(const std::string& name, const std::string& where) {
  for (const auto& [layout, text] : kLayoutNames) {
    if (text == name) return layout;
  }
  throw Error(where, fmt::format("the intention is '{}', not paper, flagged or bounded", name),
              kRemedy);
}

// Latent size that the blocks of a residual network see; `otherwise` for a chain of layers.
int LatentSeen(const nn::AnyWeights& weights, int otherwise) {
  const auto* const residual = std::get_if<nn::ResidualWeights>(&weights);
  return residual ? residual->LatentSize() : otherwise;
}

void CheckSizes(const NetworkWeights& weights, const std::string& where) {
  const int condition = ConditionSize(weights.layout), latent = weights.LatentSize();
  if (latent < 1) {
    throw Error(where,
                fmt::format("the decoder takes {} values, more than the condition's {} are needed",
                            nn::InputSize(weights.decoder), condition),
                kRemedy);
  }
  if (nn::OutputSize(weights.decoder) != kStateSize) {
    throw Error(where,
                fmt::format("the decoder gives {} values, but a delta has {}",
                            nn::OutputSize(weights.decoder), kStateSize),
                kRemedy);
  }
  if (const int seen = LatentSeen(weights.decoder, latent); seen != latent) {
    throw Error(
        where,
        fmt::format("the decoder's blocks take {} latents, but the decoder has {}", seen, latent),
        kRemedy);
  }
  if (!weights.encoder) return;
  if (const int seen = LatentSeen(*weights.encoder, 0); seen != 0) {
    throw Error(where,
                fmt::format("the encoder's blocks take {} latents, but an encoder has none", seen),
                kRemedy);
  }
  if (nn::InputSize(*weights.encoder) != kStateSize + condition ||
      nn::OutputSize(*weights.encoder) != 2 * latent) {
    throw Error(where,
                fmt::format("the encoder is {} -> {}, but the decoder needs {} -> {}",
                            nn::InputSize(*weights.encoder), nn::OutputSize(*weights.encoder),
                            kStateSize + condition, 2 * latent),
                kRemedy);
  }
}

}  // namespace

NetworkWeights ReadNetwork(const std::filesystem::path& path) {
  return ReadNetwork(SafetensorsReader(path), path.string());
}

NetworkWeights ReadNetwork(const SafetensorsReader& file, const std::string& where) {
  NetworkWeights weights;
  weights.notes = file.Metadata();
  if (const auto format = weights.notes.extract("format"); !format.empty()) {
    // "pt" is written by PyTorch itself.
    if (format.mapped() != kFormat && format.mapped() != "pt") {
      throw Error(where, fmt::format("its format is '{}', not '{}'", format.mapped(), kFormat),
                  kRemedy);
    }
  }
  if (const auto layout = weights.notes.extract("intention"); !layout.empty()) {
    weights.layout = LayoutOf(layout.mapped(), where);
  }
  nn::TensorMap tensors;
  bool has_encoder = false;
  for (const std::string& name : file.Names()) {
    const bool encoder = nn::IsTensorOf("encoder", name);
    has_encoder |= encoder;
    if (!encoder && !nn::IsTensorOf("decoder", name) && !name.starts_with("statistics.")) continue;
    const NpyMember member = file.Read(name);
    tensors[name] = {member.array.shape, member.AsFloats()};
  }
  weights.decoder = nn::AnyFromTensors(tensors, "decoder", where);
  if (has_encoder) weights.encoder = nn::AnyFromTensors(tensors, "encoder", where);
  weights.statistics = StatisticsFromTensors(tensors, where);
  CheckSizes(weights, where);
  return weights;
}

template <typename Real>
Network<Real>::Network(const NetworkWeights& weights, Isa isa)
    : layout_(weights.layout),
      latent_size_(weights.LatentSize()),
      normalizer_(weights.statistics),
      decoder_(nn::MakeNetwork<Real>(weights.decoder, isa)) {
  CheckSizes(weights, "network");
}

template class Network<float>;
template class Network<double>;

}  // namespace holdfast::wandr

namespace holdfast {

ReachNetwork LoadReachNetwork(const std::string& path) {
  if (path.empty()) {
    const EmbeddedFile file = FindEmbedded("networks/wandr.safetensors");
    return {"embedded", wandr::DefaultNetwork(),
            Checksum(ByteSource(file.bytes, std::string(file.name)))};
  }
  return {path, wandr::ReadNetwork(std::filesystem::path(path)),
          Checksum(ByteSource(std::filesystem::path(path)))};
}

}  // namespace holdfast

namespace holdfast::wandr {
namespace {

constexpr std::string_view kName = "networks/wandr.safetensors";

}  // namespace

bool HasDefaultNetwork() { return HasEmbedded(kName); }

NetworkWeights DefaultNetwork() {
  const EmbeddedFile file = FindEmbedded(kName);
  const std::string name(file.name);
  return ReadNetwork(SafetensorsReader(ByteSource(file.bytes, name)), name);
}

}  // namespace holdfast::wandr
