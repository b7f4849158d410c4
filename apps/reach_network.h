// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "generator/wandr/reach_network.h"

namespace holdfast::apps {

/// LoadReachNetwork; warns of a network that has to be trained again.
ReachNetwork LoadReachNetwork(const std::string& path, const CommonOptions& common);

/// Source, checksum, layout, notes.
nlohmann::json NetworkJson(const ReachNetwork& network);

/// Adds --weights, which is required when none are embedded.
void AddWeightsOption(CLI::App& command, std::string& path);

}  // namespace holdfast::apps
