// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace holdfast {

/// Named little-endian arrays behind one another, for a page that reads them as typed arrays.
class ReportPayload {
 public:
  /// Element types: float, int16, int8, uint32, uint16, uint8. `stride` is the number of values of
  /// one row (a vertex, a frame), for the reader.
  template <typename T>
  void Add(std::string_view name, std::span<const T> values, int stride);
  template <typename T>
  void Add(std::string_view name, const std::vector<T>& values, int stride) {
    Add(name, std::span<const T>(values), stride);
  }

  /// {name: {type, offset, count, stride}}: type as in "f32", offset in bytes.
  const nlohmann::json& Directory() const { return directory_; }

  /// All arrays, deflated (zlib format), as base64.
  std::string Encode() const;

 private:
  nlohmann::json directory_ = nlohmann::json::object();
  std::string bytes_;
};

}  // namespace holdfast
