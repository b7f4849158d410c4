// SPDX-License-Identifier: MIT
#include "generator/wandr/reach_network.h"

#include <filesystem>

#include "generator/wandr/default_network.h"
#include "geometry/embedded.h"
#include "geometry/io/container/checksum.h"

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
