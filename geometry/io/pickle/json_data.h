// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "geometry/io/container/data_value.h"

namespace holdfast {

/// Whether a text is JSON lines: a JSON value a line, more than one.
bool IsJsonLines(std::string_view text);

/// A JSON text as plain data, JSON lines as a list of their values; `where` names the file in
/// errors. Throws Error for what is not JSON (with the place), for more than 100 levels, and for
/// values that would take more memory than `memory_limit` bytes.
DataValue ReadJsonData(std::string_view text, const std::string& where, std::size_t memory_limit);

}  // namespace holdfast
