// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace holdfast::apps {

/// "Did you mean 'fit'? " where one of the known names is near what was given; otherwise nothing.
std::string Suggestion(const std::string& given, const std::vector<std::string>& known);

}  // namespace holdfast::apps
