// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/import/file_kind.h"

namespace holdfast {

/// Tells what a JSON file is by its keys: fills `kind` and `detail` (the schema, the top keys, or
/// why it is not JSON). Does not throw.
void IdentifyJson(const std::filesystem::path& path, Identity& identity);

}  // namespace holdfast
