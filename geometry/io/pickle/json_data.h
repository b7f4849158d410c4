// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "geometry/io/container/data_value.h"

namespace holdfast {

/// A JSON text as plain data; `where` names the file in errors. Throws Error for what is not JSON
/// (with the place), for more than 100 levels, and for values that would take more memory than
/// `memory_limit` bytes.
DataValue ReadJsonData(std::string_view text, const std::string& where, std::size_t memory_limit);

}  // namespace holdfast
