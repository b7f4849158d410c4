// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/import/file_kind.h"

namespace holdfast {

/// Detects what a zip archive is from its member names and the shapes of a few members: fills
/// `kind`, `members` and `detail`. Does not throw.
void IdentifyArchive(const std::filesystem::path& path, Identity& identity);

/// Detects what a JSON file is from its keys: fills `kind` and `detail` (the schema, the top keys,
/// or why it is not JSON). Does not throw.
void IdentifyJson(const std::filesystem::path& path, Identity& identity);

}  // namespace holdfast
