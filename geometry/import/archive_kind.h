// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/import/file_kind.h"

namespace holdfast {

/// Tells what a zip archive is by the names of its members and the shapes of a few: fills `kind`,
/// `members` and `detail`. Does not throw.
void IdentifyArchive(const std::filesystem::path& path, Identity& identity);

}  // namespace holdfast
