// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

namespace holdfast {

/// A file name with one %d or %0Nd in it, for numbered files.
struct NumberedName {
  std::string before, after;
  int digits = 1;

  std::string Name(int number) const;
};

/// Nothing for a name without '%'. Throws Error for one that is not such a pattern.
std::optional<NumberedName> ParseNumberedName(const std::string& name);

}  // namespace holdfast
