// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// Number of insertions, deletions, replacements or adjacent swaps that turn `a` into `b`.
int EditDistance(std::string_view a, std::string_view b);

/// Returns "Did you mean 'fit'? " if a known name is similar to the given one, or is the given one
/// with a suffix ("azimuth" of "azimuth_deg"); otherwise nothing.
std::string Suggestion(const std::string& given, const std::vector<std::string>& known);

/// A file name with one %d or %0Nd in it, for numbered files.
struct NumberedName {
  std::string before, after;
  int digits = 1;

  std::string Name(int number) const;
};

/// Returns nothing for a name without '%'. Throws Error for any other invalid pattern.
std::optional<NumberedName> ParseNumberedName(const std::string& name);

}  // namespace holdfast
