// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// Letters to insert, delete, replace or swap with their neighbour to turn `a` into `b`.
int EditDistance(std::string_view a, std::string_view b);

/// "Did you mean 'fit'? " where one of the known names is near what was given; otherwise nothing.
std::string Suggestion(const std::string& given, const std::vector<std::string>& known);

}  // namespace holdfast
