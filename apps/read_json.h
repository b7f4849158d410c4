// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <fstream>

#include <nlohmann/json.hpp>

namespace holdfast::apps {

/// A JSON file; a discarded value (no object, no array) where it is missing or malformed.
inline nlohmann::json ReadJson(const std::filesystem::path& path) {
  std::ifstream file(path);
  return nlohmann::json::parse(file, nullptr, /*allow_exceptions=*/false);
}

}  // namespace holdfast::apps
