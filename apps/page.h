// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "geometry/report/report_page.h"

namespace holdfast::apps {

/// Returns a page up to its first paragraph: head, style (CSS), heading.
std::string PageHead(const std::string& title, const std::string& heading,
                     const std::string& style);

/// CSS rules shared by pages with tables.
extern const char* const kTableStyle;

/// Returns a table of plain text. Heads are optional.
std::string HtmlTable(const std::vector<std::string>& heads,
                      const std::vector<std::vector<std::string>>& rows);

}  // namespace holdfast::apps
