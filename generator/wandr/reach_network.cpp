// SPDX-License-Identifier: MIT
#include "generator/wandr/reach_network.h"

#include <filesystem>
#include <string>

#include "geometry/embedded.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/safetensors.h"

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
