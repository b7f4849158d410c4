// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "generator/wandr/network.h"
#include "geometry/io/container/byte_source.h"

namespace holdfast::apps {

/// Weights of the reach generator as a command has them.
struct ReachNetwork {
  std::string source;  ///< the file, or "embedded"
  wandr::NetworkWeights weights;
  std::string checksum;  ///< of weights and statistics: tells networks apart

  nlohmann::json ToJson() const;  ///< source, checksum, layout, notes
};

/// The weights in a file, or the embedded ones when `path` is empty. Throws Error when there are
/// none.
ReachNetwork LoadReachNetwork(const std::string& path);

/// Adds --weights, which is required when none are embedded.
void AddWeightsOption(CLI::App& command, std::string& path);

/// FNV-1a (Fowler, Noll & Vo), 64 bits, as text.
std::string Checksum(std::string_view bytes);
/// The same of all bytes of a source.
std::string Checksum(const ByteSource& source);

}  // namespace holdfast::apps
