// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

namespace holdfast {

/// Tries that a manifest has, and the lines of it that are whole.
struct VariantManifest {
  int tried = 0, kept = 0;
  std::string text;
  std::map<std::string, int> refused;
};

/// Of a folder of variants with what was asked, the first line. Empty where nothing is there yet.
/// Throws Error for a folder that holds something else, or variants of other `asked`.
VariantManifest ReadManifest(const std::filesystem::path& path, const nlohmann::json& asked);

}  // namespace holdfast
