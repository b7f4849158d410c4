// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace holdfast::apps {

/// "640x480" as a pair of numbers from 1 to 16384; nothing for anything else.
std::optional<std::pair<int, int>> ParsePair(const std::string& text);

}  // namespace holdfast::apps
