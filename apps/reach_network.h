// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "apps/common.h"
#include "generator/wandr/reach_network.h"

namespace holdfast::apps {

/// Source, checksum, layout, notes.
nlohmann::json NetworkJson(const ReachNetwork& network);

/// Adds --weights, which is required when none are embedded.
void AddWeightsOption(CLI::App& command, std::string& path);

}  // namespace holdfast::apps
