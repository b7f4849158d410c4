// SPDX-License-Identifier: MIT
#include "apps/report_page.h"

#include <cstddef>

#include <fmt/format.h>

#include "apps/page.h"
#include "apps/report_writer.h"
#include "geometry/error.h"

#ifdef HOLDFAST_HAS_PLAYER
extern "C" const char holdfast_player_page[], holdfast_player_page_end[];
#endif

namespace holdfast::apps {
namespace {

// The page that apps/report/build.mjs makes, with markers where title and data go.
std::string_view PlayerPage() {
#ifdef HOLDFAST_HAS_PLAYER
  return {holdfast_player_page,
          static_cast<std::size_t>(holdfast_player_page_end - holdfast_player_page)};
#else
  return {};
#endif
}

constexpr std::string_view kTitleMarker = "<!--holdfast:title-->";
constexpr std::string_view kDataMarker = "<!--holdfast:data-->";

// In JSON a '<' stands only within strings, where its escape means the same: no text can close the
// script element that holds it.
std::string JsonForScript(const nlohmann::json& value) {
  const std::string plain =
      value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);  // bad UTF-8: U+FFFD
  std::string text;
  text.reserve(plain.size());
  for (const char c : plain) {
    c == '<' ? text += "\\u003c" : text += c;
  }
  return text;
}

}  // namespace

bool HasReportPlayer() { return !PlayerPage().empty(); }

void RequirePlayer() {
  if (HasReportPlayer()) return;
  throw Error("report", "this program was built without the player",
              "Install nodejs and npm and build with -DHOLDFAST_BUILD_PLAYER=ON");
}

std::string ReportPage(const nlohmann::json& header, std::span<const std::string> payloads) {
  RequirePlayer();
  const std::string_view page = PlayerPage();
  const std::size_t title = page.find(kTitleMarker);
  const std::size_t data = page.find(kDataMarker);
  if (title == std::string_view::npos || data == std::string_view::npos || data < title) {
    throw std::logic_error("the player's page has no places for title and data");
  }
  std::string text(page.substr(0, title));
  text += EscapeHtml(header.at("title").get<std::string>());
  text += page.substr(title + kTitleMarker.size(), data - title - kTitleMarker.size());
  text += "<script type=\"application/json\" id=\"report-header\">" + JsonForScript(header) +
          "</script>\n";
  for (std::size_t k = 0; k < payloads.size(); ++k) {
    text += fmt::format("<script type=\"text/plain\" id=\"report-payload-{}\">", k);
    text += payloads[k];
    text += "</script>\n";
  }
  text += page.substr(data + kDataMarker.size());
  return text;
}

}  // namespace holdfast::apps
