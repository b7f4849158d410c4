// SPDX-License-Identifier: MIT
#include "geometry/suggestion.h"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include "geometry/error.h"

namespace holdfast {

int EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::vector<int>> distance(a.size() + 1, std::vector<int>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      int& best = distance[i][j];
      if (i == 0 || j == 0) {
        best = static_cast<int>(i + j);
        continue;
      }
      best = std::min({distance[i - 1][j] + 1, distance[i][j - 1] + 1,
                       distance[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        best = std::min(best, distance[i - 2][j - 2] + 1);
      }
    }
  }
  return distance[a.size()][b.size()];
}

std::string Suggestion(const std::string& given, const std::vector<std::string>& known) {
  // A name without its unit is close, however short it is.
  const auto distance = [&](const std::string& name) {
    return name.starts_with(given + "_") ? 1 : EditDistance(given, name);
  };
  const auto nearest = std::ranges::min_element(known, {}, distance);
  if (nearest == known.end()) return "";
  const auto length = static_cast<int>(std::max(given.size(), nearest->size()));
  if (distance(*nearest) > std::max(1, length / 3)) return "";
  return fmt::format("Did you mean '{}'? ", *nearest);
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

}  // namespace holdfast
