// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>
#include <filesystem>

namespace holdfast::testing {

/// The folder with real motion and objects: HOLDFAST_DATA, else shared/data beside the source.
inline std::filesystem::path DataFolder() {
  if (const char* folder = std::getenv("HOLDFAST_DATA")) return folder;
  return std::filesystem::path(HOLDFAST_SOURCE_DIR).parent_path() / "shared" / "data";
}

}  // namespace holdfast::testing
