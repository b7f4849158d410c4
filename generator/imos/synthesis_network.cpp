// SPDX-License-Identifier: MIT
#include "generator/imos/synthesis_network.h"

#include <filesystem>
#include <string>

#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/safetensors.h"

namespace holdfast {
namespace {

constexpr double kPublishedSeconds = 0.1;

// Returns a JSON note of the weights, or an empty object if there is none.
nlohmann::json JsonNote(const imos::NetworkWeights& weights, const std::string& name,
                        const std::string& where) {
  const auto note = weights.notes.find(name);
  if (note == weights.notes.end()) return nlohmann::json::object();
  nlohmann::json value = nlohmann::json::parse(note->second, nullptr, false);
  if (!value.is_object()) {
    throw Error(where, "its note '" + name + "' is not a JSON object",
                "Use weights of 'holdfast.train imos'");
  }
  return value;
}

}  // namespace

SynthesisNetwork LoadSynthesisNetwork(const std::string& path, const std::string& embeddings) {
  SynthesisNetwork network;
  if (path.empty()) {
    const EmbeddedFile file = FindEmbedded("networks/imos.safetensors");
    network.source = "embedded";
    network.weights = imos::DefaultNetwork();
    network.checksum = Checksum(ByteSource(file.bytes, std::string(file.name)));
  } else {
    network.source = path;
    network.weights = imos::ReadNetwork(std::filesystem::path(path));
    network.checksum = Checksum(ByteSource(std::filesystem::path(path)));
  }
  network.action_table =
      embeddings.empty() ? imos::ActionTable(network.weights)
                         : imos::ReadActionTable(embeddings, network.weights.config.action_size);
  const nlohmann::json seconds = JsonNote(network.weights, "seconds_per_key_frame", network.source);
  for (const auto& [action, value] : seconds.items()) {
    if (value.is_number() && value.get<double>() > 0.0) network.seconds[action] = value;
  }
  const nlohmann::json seen = JsonNote(network.weights, "seen", network.source);
  for (const auto& [action, objects] : seen.items()) network.seen[action] = objects;
  return network;
}

std::vector<std::string> SynthesisNetwork::Actions() const {
  std::vector<std::string> names;
  for (const imos::Action& action : imos::Actions()) {
    if (seen.empty() || seen.contains(std::string(action.label))) names.emplace_back(action.label);
  }
  return names;
}

double SynthesisNetwork::SecondsPerKeyFrame(int action) const {
  const auto found = seconds.find(std::string(imos::Actions()[action].label));
  if (found != seconds.end()) return found->second;
  double sum = 0.0;
  for (const auto& [name, value] : seconds) sum += value;
  return seconds.empty() ? kPublishedSeconds : sum / static_cast<double>(seconds.size());
}

nlohmann::json SynthesisNetwork::ToJson() const {
  return {{"weights", source}, {"checksum", checksum}, {"notes", weights.notes}};
}

}  // namespace holdfast

namespace holdfast::imos {
namespace {

constexpr std::string_view kName = "networks/imos.safetensors";

}  // namespace

bool HasDefaultNetwork() { return HasEmbedded(kName); }

NetworkWeights DefaultNetwork() {
  const EmbeddedFile file = FindEmbedded(kName);
  const std::string name(file.name);
  return ReadNetwork(SafetensorsReader(ByteSource(file.bytes, name)), name);
}

}  // namespace holdfast::imos
