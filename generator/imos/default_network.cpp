// SPDX-License-Identifier: MIT
#include "generator/imos/default_network.h"

#include <string>

#include "geometry/embedded.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/safetensors.h"

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
