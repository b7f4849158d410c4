// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// Letters to insert, delete, replace or swap with their neighbor to turn `a` into `b`.
int EditDistance(std::string_view a, std::string_view b);

/// "Did you mean 'fit'? " where one of the known names is near what was given; otherwise nothing.
std::string Suggestion(const std::string& given, const std::vector<std::string>& known);

/// A file name with one %d or %0Nd in it, for numbered files.
struct NumberedName {
  std::string before, after;
  int digits = 1;

  std::string Name(int number) const;
};

/// Nothing for a name without '%'. Throws Error for one that is not such a pattern.
std::optional<NumberedName> ParseNumberedName(const std::string& name);

}  // namespace holdfast
