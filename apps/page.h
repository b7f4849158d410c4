// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "geometry/report/report_page.h"

namespace holdfast::apps {

/// Everything up to a page's first paragraph: head, style (CSS), heading.
std::string PageHead(const std::string& title, const std::string& heading,
                     const std::string& style);

/// The rules that pages with tables share.
extern const char* const kTableStyle;

/// A table of plain text. May do without heads.
std::string HtmlTable(const std::vector<std::string>& heads,
                      const std::vector<std::vector<std::string>>& rows);

}  // namespace holdfast::apps
