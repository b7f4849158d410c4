// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "generator/wandr/reach_network.h"

namespace holdfast::apps {

/// Calls LoadReachNetwork; warns if the network has to be retrained.
ReachNetwork LoadReachNetwork(const std::string& path, const CommonOptions& common);

/// Returns source, checksum, layout and notes.
nlohmann::json NetworkJson(const ReachNetwork& network);

/// Adds --weights, which is required if there are no embedded weights.
void AddWeightsOption(CLI::App& command, std::string& path);

}  // namespace holdfast::apps
