// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "generator/wandr/network.h"

namespace holdfast {

/// Weights of the reach generator, and where they are from.
struct ReachNetwork {
  std::string source;  ///< the file, or "embedded"
  wandr::NetworkWeights weights;
  std::string checksum;  ///< of weights and statistics: tells networks apart
};

/// The weights in a file, or the embedded ones when `path` is empty. Throws Error when there are
/// none.
ReachNetwork LoadReachNetwork(const std::string& path = {});

}  // namespace holdfast

namespace holdfast::wandr {

/// Whether this library was built with trained weights in it (meshes/networks/wandr.safetensors).
bool HasDefaultNetwork();

/// Those weights. Throws Error when there are none.
NetworkWeights DefaultNetwork();

}  // namespace holdfast::wandr
