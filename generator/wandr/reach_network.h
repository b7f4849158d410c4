// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "generator/wandr/network.h"

namespace holdfast {

/// Weights of the reach generator and their origin.
struct ReachNetwork {
  std::string source;  ///< the file, or "embedded"
  wandr::NetworkWeights weights;
  std::string checksum;  ///< of weights and statistics; identifies the network
};

/// Reads the weights in a file, or the embedded ones if `path` is empty. Throws Error if there are
/// none.
ReachNetwork LoadReachNetwork(const std::string& path = {});

}  // namespace holdfast

namespace holdfast::wandr {

/// Returns whether the library has embedded trained weights (meshes/networks/wandr.safetensors).
bool HasDefaultNetwork();

/// Returns the embedded weights. Throws Error if there are none.
NetworkWeights DefaultNetwork();

}  // namespace holdfast::wandr
