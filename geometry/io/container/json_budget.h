// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace holdfast {

/// Parses JSON whose values take at most ten times `file_bytes` and 32 MB of memory: a text of
/// "{},{},{}," alone would take thirty times its size. Throws Error for that, for text that is no
/// JSON (with the place) and for nesting deeper than 100. For library sources only.
nlohmann::json ParseJsonWithin(std::string_view text, const std::string& where,
                               std::size_t file_bytes);

}  // namespace holdfast
