// SPDX-License-Identifier: MIT
#include "apps/render_output.h"

#include <charconv>

namespace holdfast::apps {
namespace {

constexpr int kMaxSide = 16384;  // pixels, or tiles

}  // namespace

std::optional<std::pair<int, int>> ParsePair(const std::string& text) {
  int a = 0;
  int b = 0;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, a);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != 'x') return std::nullopt;
  const auto second = std::from_chars(first.ptr + 1, end, b);
  if (second.ec != std::errc() || second.ptr != end || a < 1 || b < 1) return std::nullopt;
  if (a > kMaxSide || b > kMaxSide) return std::nullopt;
  return std::pair(a, b);
}

}  // namespace holdfast::apps
