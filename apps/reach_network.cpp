// SPDX-License-Identifier: MIT
#include "apps/reach_network.h"

#include <cstdint>

#include <fmt/format.h>

#include "generator/wandr/default_network.h"
#include "geometry/embedded.h"
#include "geometry/io/container/byte_source.h"

namespace holdfast::apps {
namespace {

const char* LayoutName(wandr::IntentionLayout layout) {
  switch (layout) {
    case wandr::IntentionLayout::kPaper:
      return "paper";
    case wandr::IntentionLayout::kFlagged:
      return "flagged";
    case wandr::IntentionLayout::kBounded:
      return "bounded";
  }
  return "";
}

}  // namespace

std::string Checksum(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ull;
  for (const char c : bytes) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  }
  return fmt::format("{:016x}", hash);
}

std::string Checksum(const ByteSource& source) {
  std::string bytes(source.Size(), '\0');
  source.ReadAt(0, std::as_writable_bytes(std::span(bytes)));
  return Checksum(bytes);
}

ReachNetwork LoadReachNetwork(const std::string& path) {
  if (path.empty()) {
    const EmbeddedFile file = FindEmbedded("networks/wandr.safetensors");
    return {"embedded", wandr::DefaultNetwork(),
            Checksum(ByteSource(file.bytes, std::string(file.name)))};
  }
  return {path, wandr::ReadNetwork(std::filesystem::path(path)),
          Checksum(ByteSource(std::filesystem::path(path)))};
}

nlohmann::json ReachNetwork::ToJson() const {
  return {{"weights", source},
          {"checksum", checksum},
          {"intention", LayoutName(weights.layout)},
          {"notes", weights.notes}};
}

void AddWeightsOption(CLI::App& command, std::string& path) {
  const bool embedded = wandr::HasDefaultNetwork();
  command
      .add_option("--weights", path,
                  embedded ? "Network (.safetensors) in place of the embedded one"
                           : "Network (.safetensors); this program was built without one")
      ->required(!embedded);
}

}  // namespace holdfast::apps
