// SPDX-License-Identifier: MIT
#include "apps/page.h"

#include <algorithm>

#include <fmt/format.h>

namespace holdfast::apps {
namespace {

constexpr const char* kStudyStyle = R"(
th, td { padding: .3rem .45rem; text-align: right; white-space: nowrap; border-bottom: 1px solid #8886; }
th:first-child, td:first-child { text-align: left; }
tr.full td { font-weight: 600; }
table.many th:not(:first-child) { white-space: normal; max-width: 5.2rem; vertical-align: bottom; }
table.many td:first-child { white-space: normal; min-width: 11rem; }
figure { display: inline-block; margin: .4rem; }
svg { font: 11px system-ui, sans-serif; fill: currentColor; }
svg .title { font-size: 13px; font-weight: 600; }
svg .value { font-size: 9px; opacity: .75; }
svg .grid { stroke: #8884; } svg .limit { stroke: #888; stroke-dasharray: 4 3; }
svg .place { stroke: #2f6f9f88; } svg .person { fill: #888; } svg .light { fill: #fff; }
)";

}  // namespace

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

std::string StudyPageHead(const std::string& title) {
  return PageHead(title, title, std::string(kTableStyle) + kStudyStyle);
}

std::string MarkdownTable(const std::vector<std::string>& heads,
                          const std::vector<std::vector<std::string>>& rows, bool numbers) {
  std::string text;
  const auto add = [&](const std::vector<std::string>& cells) {
    text += "|";
    for (const std::string& cell : cells) text += fmt::format(" {} |", cell);
    text += "\n";
  };
  add(heads);
  text += "|";
  for (std::size_t k = 0; k < heads.size(); ++k) text += numbers && k > 0 ? "---:|" : "---|";
  text += "\n";
  for (const std::vector<std::string>& row : rows) add(row);
  return text;
}

std::string HtmlTable(const std::vector<std::string>& heads,
                      const std::vector<std::vector<std::string>>& rows,
                      const std::vector<int>& strong, const std::string& kind) {
  std::string html = "<div class=\"scroll\"><table";
  if (!kind.empty()) html += fmt::format(" class=\"{}\"", kind);
  html += ">";
  const auto add = [&](const std::vector<std::string>& cells, const char* open, const char* cell) {
    html += open;
    for (const std::string& text : cells) {
      html += fmt::format("<{0}>{1}</{0}>", cell, EscapeHtml(text));
    }
    html += "</tr>";
  };
  if (!heads.empty()) add(heads, "<tr>", "th");
  html += "\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const bool is_strong = std::ranges::count(strong, static_cast<int>(r)) > 0;
    add(rows[r], is_strong ? "<tr class=\"full\">" : "<tr>", "td");
    html += "\n";
  }
  return html + "</table></div>\n";
}

}  // namespace holdfast::apps
