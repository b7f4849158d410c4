// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "geometry/report/report_page.h"

namespace holdfast::apps {

/// Everything up to a page's first paragraph: head, style (CSS), heading.
std::string PageHead(const std::string& title, const std::string& heading,
                     const std::string& style);
/// The same for a study, whose title is its heading.
std::string StudyPageHead(const std::string& title);

/// The rules that pages with tables share.
extern const char* const kTableStyle;

/// A table of plain text; `numbers` stand to the right but in the first column.
std::string MarkdownTable(const std::vector<std::string>& heads,
                          const std::vector<std::vector<std::string>>& rows, bool numbers = false);
/// The same as HTML, of a CSS class or none; rows of `strong` are to be seen first. May do without
/// heads.
std::string HtmlTable(const std::vector<std::string>& heads,
                      const std::vector<std::vector<std::string>>& rows,
                      const std::vector<int>& strong = {}, const std::string& kind = "");

}  // namespace holdfast::apps
