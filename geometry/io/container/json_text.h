// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "geometry/io/container/data_store.h"

namespace holdfast {

/// The bytes where they are UTF-8; else read as Latin-1, in which every byte is a character.
inline std::string AsUtf8(std::string_view bytes) {
  if (IsUtf8(bytes)) return std::string(bytes);
  std::string text;
  for (const char c : bytes) {
    const auto code = static_cast<unsigned char>(c);
    if (code < 0x80) {
      text += c;
    } else {
      text += static_cast<char>(0xc0 | code >> 6);
      text += static_cast<char>(0x80 | (code & 0x3f));
    }
  }
  return text;
}

/// A JSON value with every name and text as UTF-8 (AsUtf8).
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

/// JSON as text, in one line, or indented where `indent` is not negative. Names of files, markers
/// and joints may be any bytes, JSON is UTF-8: other texts are written as WithUtf8 has them, and
/// what is no character even so as U+FFFD. Every JSON that leaves the library goes through here.
template <typename Json>
std::string JsonText(const Json& value, int indent = -1) {
  using Handler = typename Json::error_handler_t;
  try {
    return value.dump(indent);
  } catch (const typename Json::type_error&) {
    return WithUtf8(value).dump(indent, ' ', false, Handler::replace);
  }
}

}  // namespace holdfast
