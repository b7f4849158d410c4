// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/data_store.h"
#include "geometry/io/container/text_scanner.h"

namespace holdfast {

/// Returns the bytes if they are UTF-8; else reads them as Latin-1, in which every byte is a
/// character.
inline std::string AsUtf8(std::string_view bytes) {
  if (IsUtf8(bytes)) return std::string(bytes);
  std::string text;
  for (const char c : bytes) AppendUtf8(text, static_cast<unsigned char>(c));
  return text;
}

/// Converts every name and text of a JSON value to UTF-8 (AsUtf8).
template <typename Json>
Json WithUtf8(const Json& value) {
  if (value.is_string()) return AsUtf8(value.template get_ref<const std::string&>());
  if (!value.is_structured()) return value;
  Json texts = value.is_array() ? Json::array() : Json::object();
  for (auto entry = value.begin(); entry != value.end(); ++entry) {
    if (value.is_array()) {
      texts.push_back(WithUtf8(*entry));
    } else {
      texts[AsUtf8(entry.key())] = WithUtf8(*entry);
    }
  }
  return texts;
}

/// JSON as text, in one line, or indented if `indent` is not negative. JSON is UTF-8, but names of
/// files, markers and joints may be any bytes: such texts are converted by WithUtf8, and remaining
/// invalid characters become U+FFFD. All JSON that the library writes goes through here.
template <typename Json>
std::string JsonText(const Json& value, int indent = -1) {
  using Handler = typename Json::error_handler_t;
  try {
    return value.dump(indent);
  } catch (const typename Json::type_error&) {
    return WithUtf8(value).dump(indent, ' ', false, Handler::replace);
  }
}

/// Parses JSON whose values take at most eight times `file_bytes` plus 32 MB of memory; a text of
/// "{},{},{}," alone would take thirty times its size. Throws Error if they take more, for text
/// that is not JSON (with the position) and for nesting deeper than 100. For library sources only.
nlohmann::json ParseJsonWithin(std::string_view text, const std::string& where,
                               std::size_t file_bytes);

/// Reads a JSON file; returns a discarded value (neither object nor array) if it is missing or
/// malformed. Throws Error if it is not a regular file.
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

/// Returns the result of `use` on the values of a JSON file. A value that is missing or has an
/// unexpected type is an Error about the file.
template <typename Use>
auto UseJson(const std::filesystem::path& path, const Use& use) {
  try {
    return use();
  } catch (const nlohmann::json::exception&) {
    throw Error(path.string(), "is damaged: a value is missing or has the wrong type",
                "Delete it, or generate it again");
  }
}

/// Removes the wall times from a result and returns them in the same structure: an object of the
/// keys that held times, a list with null for each element without times; null if there are none. A
/// result without its times has the same bytes in every run. json_file.cpp lists the keys.
nlohmann::json TakeWallTimes(nlohmann::json& result);

/// Writes `result` without its wall times to `file`, and the times to `times_file` (not written if
/// there are none). Returns the content of `file`.
nlohmann::json WriteWithoutWallTimes(nlohmann::json result, const std::filesystem::path& file,
                                     const std::filesystem::path& times_file);

}  // namespace holdfast
