// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>

#include <nlohmann/json.hpp>

namespace holdfast::apps {

/// Throws Error that says how to build the player in when it is not.
void RequirePlayer();

/// The player's page with a title, a header and one payload per clip in it. Whatever the header's
/// texts hold stays text: it can neither end its element nor run.
std::string ReportPage(const nlohmann::json& header, std::span<const std::string> payloads);

}  // namespace holdfast::apps
