// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_budget.h"

namespace holdfast {

/// A JSON file; a discarded value (no object, no array) where it is missing or malformed. Throws
/// Error for what is not a regular file.
inline nlohmann::json ReadJson(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored) || std::filesystem::file_size(path, ignored) == 0) {
    return nlohmann::json::value_t::discarded;
  }
  const std::string text = ReadFile(path, std::size_t{1} << 30);
  try {
    return ParseJsonWithin(text, path.string(), text.size());
  } catch (const Error&) {
    return nlohmann::json::value_t::discarded;
  }
}

/// What `use` makes of the values of a JSON file; one of another type than it expects, or that is
/// not there, is an Error about the file.
template <typename Use>
auto UseJson(const std::filesystem::path& path, const Use& use) {
  try {
    return use();
  } catch (const nlohmann::json::exception&) {
    throw Error(path.string(),
                "is damaged: a value is missing, or of another type than it should be",
                "Remove it, or make it anew");
  }
}

}  // namespace holdfast
