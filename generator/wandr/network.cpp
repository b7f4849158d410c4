// SPDX-License-Identifier: MIT
#include "generator/wandr/network.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/safetensors.h"
#include "geometry/io/pickle/data_file.h"

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

bool IsOfNetwork(const std::string& name) {
  return nn::IsTensorOf("encoder", name) || nn::IsTensorOf("decoder", name);
}

// Sets networks and statistics.
void SetTensors(const nn::TensorMap& tensors, const std::string& where, NetworkWeights& weights) {
  const bool has_encoder = std::ranges::any_of(
      tensors, [](const auto& entry) { return nn::IsTensorOf("encoder", entry.first); });
  weights.decoder = nn::AnyFromTensors(tensors, "decoder", where);
  if (has_encoder) weights.encoder = nn::AnyFromTensors(tensors, "encoder", where);
  weights.statistics = StatisticsFromTensors(tensors, where);
  CheckSizes(weights, where);
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
  for (const std::string& name : file.Names()) {
    if (!IsOfNetwork(name) && !name.starts_with("statistics.")) continue;
    const NpyMember member = file.Read(name);
    tensors[name] = {member.array.shape, member.AsFloats()};
  }
  SetTensors(tensors, where, weights);
  return weights;
}

void WriteNetwork(const NetworkWeights& weights, const std::filesystem::path& path, bool half) {
  nn::TensorMap tensors;
  nn::AddTensors(weights.decoder, "decoder", tensors);
  if (weights.encoder) nn::AddTensors(*weights.encoder, "encoder", tensors);
  AddTensors(weights.statistics, tensors);
  SafetensorsWriter writer;
  for (const auto& [name, tensor] : tensors) {
    if (half && !name.starts_with("statistics.")) {
      writer.AddFloat16(name, tensor.shape, tensor.values);
    } else {
      writer.AddFloat32(name, tensor.shape, tensor.values);
    }
  }
  SafetensorsMetadata metadata(weights.notes.begin(), weights.notes.end());
  metadata["format"] = kFormat;
  metadata["intention"] =
      std::ranges::find(kLayoutNames, weights.layout, &decltype(kLayoutNames)::value_type::first)
          ->second;
  writer.SetMetadata(std::move(metadata));
  writer.Write(path);
}

ImportedNetwork ImportNetwork(const std::filesystem::path& checkpoint,
                              const std::filesystem::path& statistics) {
  ImportedNetwork imported;
  nn::TensorMap tensors;
  const DataValue root = DataFile(checkpoint).Root();
  const DataValue state = root.Find("state_dict").value_or(root);
  for (const std::string& name : state.Names()) {
    // A module may hold the network as a member: "model.decoder.layers.1.weight".
    const std::size_t begin = std::min(name.find("decoder.layers."), name.find("encoder.layers."));
    if (begin == std::string::npos) {
      imported.ignored.push_back(name);
      continue;
    }
    const NpyMember member = state[name].Array();
    tensors[name.substr(begin)] = {member.array.shape, member.AsFloats()};
  }
  if (tensors.empty()) {
    throw Error(checkpoint.string(), "it has no tensor 'decoder.layers.<i>.weight'",
                "Give the checkpoint of WANDR as its training code saves it");
  }
  DataValue features = DataFile(statistics).Root();
  if (features.Kind() == DataKind::kList && features.Size() == 1) features = features[0];
  for (const std::string& feature : features.Names()) {
    for (const char* const moment : {"mean", "std"}) {
      const std::optional<DataValue> value = features[feature].Find(moment);
      if (!value) continue;
      std::vector<float> numbers = value->Array().AsFloats();
      const std::size_t count = numbers.size();
      tensors[fmt::format("statistics.{}.{}", feature, moment)] = {{count}, std::move(numbers)};
    }
  }
  SetTensors(tensors, checkpoint.string() + " and " + statistics.string(), imported.weights);
  imported.weights.notes["source"] = "imported from a PyTorch checkpoint of WANDR";
  return imported;
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
