// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/import/file_kind.h"

namespace holdfast {

/// Tells what a zip archive is by the names of its members and the shapes of a few: fills `kind`,
/// `members` and `detail`. Does not throw.
void IdentifyArchive(const std::filesystem::path& path, Identity& identity);

/// Tells what a JSON file is by its keys: fills `kind` and `detail` (the schema, the top keys, or
/// why it is not JSON). Does not throw.
void IdentifyJson(const std::filesystem::path& path, Identity& identity);

}  // namespace holdfast
