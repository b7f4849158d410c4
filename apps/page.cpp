// SPDX-License-Identifier: MIT
#include "apps/page.h"

#include <fmt/format.h>

namespace holdfast::apps {
const char* const kTableStyle = R"(
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 84rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; margin: .5rem 0 1.5rem; font-variant-numeric: tabular-nums; }
.scroll { overflow-x: auto; })";

std::string PageHead(const std::string& title, const std::string& heading,
                     const std::string& style) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>{}</title><style>{}</style>"
      "</head><body>\n<h1>{}</h1>\n",
      EscapeHtml(title), style, EscapeHtml(heading));
}

std::string HtmlTable(const std::vector<std::string>& heads,
                      const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<div class=\"scroll\"><table>";
  const auto add = [&](const std::vector<std::string>& cells, const char* cell) {
    html += "<tr>";
    for (const std::string& text : cells) {
      html += fmt::format("<{0}>{1}</{0}>", cell, EscapeHtml(text));
    }
    html += "</tr>";
  };
  if (!heads.empty()) add(heads, "th");
  html += "\n";
  for (const std::vector<std::string>& row : rows) {
    add(row, "td");
    html += "\n";
  }
  return html + "</table></div>\n";
}

}  // namespace holdfast::apps
