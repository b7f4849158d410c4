// SPDX-License-Identifier: MIT
#include "apps/motion/synthesis_network.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/motion/reach_network.h"
#include "generator/imos/default_network.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/checksum.h"

namespace holdfast::apps {
namespace {

constexpr double kPublishedSeconds = 0.1;

// A note of the weights that is JSON; an empty object where there is none.
nlohmann::json JsonNote(const imos::NetworkWeights& weights, const std::string& name,
                        const std::string& where) {
  const auto note = weights.notes.find(name);
  if (note == weights.notes.end()) return nlohmann::json::object();
  nlohmann::json value = nlohmann::json::parse(note->second, nullptr, false);
  if (!value.is_object()) {
    throw Error(where, "its note '" + name + "' is not a JSON object",
                "Use weights of 'holdfast train imos'");
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

std::string NoteOnIntent(const SynthesisNetwork& network, const imos::Intent& intent) {
  const std::string action(imos::Actions()[intent.action].label);
  const std::string object(imos::Objects()[intent.object]);
  const auto seen = network.seen.find(action);
  if (seen != network.seen.end() && seen->second.is_object() && !seen->second.contains(object)) {
    std::vector<std::string> objects;
    for (const auto& [name, count] : seen->second.items()) objects.push_back(name);
    return fmt::format("note: nobody was seen who {} a {}; seen with {}",
                       imos::Actions()[intent.action].verb, object, fmt::join(objects, ", "));
  }
  return "";
}

void AddSynthesisWeightsOptions(CLI::App& command, std::string& path, std::string& embeddings) {
  const bool embedded = imos::HasDefaultNetwork();
  command
      .add_option("--weights", path,
                  embedded ? "Networks (.safetensors) in place of the embedded ones"
                           : "Networks (.safetensors); this program was built without any")
      ->required(!embedded);
  command.add_option("--action-embeddings", embeddings,
                     "Embeddings of the 29 actions by label (.npz, .safetensors), for networks "
                     "that were trained with CLIP's");
}

}  // namespace holdfast::apps
