// SPDX-License-Identifier: MIT
#include "apps/suggestion.h"

#include <algorithm>

#include <fmt/format.h>

#include "generator/imos/vocabulary.h"

namespace holdfast::apps {

std::string Suggestion(const std::string& given, const std::vector<std::string>& known) {
  const auto distance = [&](const std::string& name) { return imos::EditDistance(given, name); };
  const auto nearest = std::ranges::min_element(known, {}, distance);
  if (nearest == known.end()) return "";
  const auto length = static_cast<int>(std::max(given.size(), nearest->size()));
  if (distance(*nearest) > std::max(1, length / 3)) return "";
  return fmt::format("Did you mean '{}'? ", *nearest);
}

}  // namespace holdfast::apps
