// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace holdfast::apps {

/// "640x480" as a pair of numbers from 1 to 16384; nothing for anything else.
std::optional<std::pair<int, int>> ParsePair(const std::string& text);

/// A file name with one %d or %0Nd in it, for numbered pictures.
struct NumberedName {
  std::string before, after;
  int digits = 1;

  std::string Name(int number) const;
};

/// Nothing for a name without '%'. Throws Error for one that is not such a pattern.
std::optional<NumberedName> ParseNumberedName(const std::string& name);

}  // namespace holdfast::apps
