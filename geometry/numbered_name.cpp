// SPDX-License-Identifier: MIT
#include "geometry/numbered_name.h"

#include <charconv>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {

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

}  // namespace holdfast
