// SPDX-License-Identifier: MIT
#include "apps/render_output.h"

#include <charconv>

#include <fmt/format.h>

#include "geometry/error.h"

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

std::string NumberedName::Name(int number) const {
  return fmt::format("{}{:0{}}{}", before, number, digits, after);
}

std::optional<NumberedName> ParseNumberedName(const std::string& name) {
  const auto percent = name.find('%');
  if (percent == std::string::npos) return std::nullopt;
  const auto letter = name.find('d', percent);
  NumberedName pattern;
  if (letter != std::string::npos) {
    const std::string width = name.substr(percent + 1, letter - percent - 1);
    const auto [end, fault] =
        std::from_chars(width.data(), width.data() + width.size(), pattern.digits);
    pattern.before = name.substr(0, percent);
    pattern.after = name.substr(letter + 1);
    const bool number = fault == std::errc() && end == width.data() + width.size();
    if ((width.empty() || number) && pattern.digits >= 0 && pattern.digits <= 9 &&
        pattern.after.find('%') == std::string::npos) {
      return pattern;
    }
  }
  throw Error(name, "is not a pattern for numbered pictures", "Write it like frame_%03d.png");
}

}  // namespace holdfast::apps
