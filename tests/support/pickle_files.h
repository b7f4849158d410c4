// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/io/pickle/pickle.h"

namespace holdfast::testing {

inline std::filesystem::path PickleFixtures() {
  return std::filesystem::path(HOLDFAST_SOURCE_DIR) / "tests" / "fixtures" / "pickle";
}

inline std::vector<std::byte> ReadBytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error("no fixture " + path.string());
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

inline DataValue ReadPickleFile(const std::filesystem::path& path,
                                const PickleOptions& options = {}) {
  return ReadPickle(OwnBytes(ReadBytes(path)), path.filename().string(), options);
}

/// A pickle written by hand.
inline DataValue ReadPickleText(std::string_view text, const PickleOptions& options = {}) {
  return ReadPickle({std::as_bytes(std::span(text.data(), text.size())), nullptr}, "x.pkl",
                    options);
}

}  // namespace holdfast::testing
