// SPDX-License-Identifier: MIT
#include "geometry/report/report_page.h"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/io/container/json_text.h"
#include "geometry/report/report_data.h"

namespace holdfast {
namespace {

// The page that player/build.mjs makes, with markers where title and data go.
constexpr std::string_view kPlayerPage = "player.html";
constexpr std::string_view kTitleMarker = "<!--holdfast:title-->";
constexpr std::string_view kDataMarker = "<!--holdfast:data-->";

std::string_view PlayerPage() {
  if (!HasReportPlayer()) {
    throw Error("report", "this program was built without the player",
                "Install nodejs and npm and build with -DHOLDFAST_BUILD_PLAYER=ON");
  }
  const auto bytes = FindEmbedded(kPlayerPage).bytes;
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// In JSON a '<' stands only within strings, where its escape means the same: no text can close the
// script element that holds it.
std::string JsonForScript(const nlohmann::json& value) {
  const std::string plain = JsonText(value);
  std::string text;
  text.reserve(plain.size());
  for (const char c : plain) {
    c == '<' ? text += "\\u003c" : text += c;
  }
  return text;
}

// "mug, demo_drink": the object, and the motion it was fitted to.
std::string TitleOf(std::span<const ReportInput> clips) {
  std::string title;
  for (const ReportInput& clip : clips) {
    std::string motion = ReportName(clip);
    if (clips.size() == 1 && clip.metrics.is_object() && clip.metrics.contains("options")) {
      const nlohmann::json& options = clip.metrics["options"];
      const auto told = options.is_object() ? options.find("clip") : options.end();
      if (options.is_object() && told != options.end() && told->is_string()) {
        motion = std::filesystem::path(told->get<std::string>()).stem().string();
      }
    }
    const std::string object = clip.clip.object ? clip.clip.object->name : "";
    if (!title.empty()) title += clips.size() == 2 ? " and " : ", ";
    title += object.empty() || clips.size() > 1 ? motion : object + ", " + motion;
  }
  return title;
}

// The player's page with the header and one payload per clip in it.
std::string PageOf(const nlohmann::json& header, const std::vector<std::string>& payloads) {
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

}  // namespace

bool HasReportPlayer() { return HasEmbedded(kPlayerPage); }

ReportPage MakeReportPage(std::span<const ReportInput> clips, const ReportPageOptions& options,
                          const StagedProgress& progress) {
  if (clips.empty()) throw Error("report", "is to show no clip", "Give a clip or more");
  PlayerPage();  // before the work
  nlohmann::json header = {{"schema", "holdfast/report/1"},
                           {"holdfast_version", HOLDFAST_VERSION},
                           {"seed", options.seed},
                           {"title", options.title.empty() ? TitleOf(clips) : options.title},
                           {"clips", nlohmann::json::array()}};
  std::vector<std::string> payloads;
  ReportPage page;
  for (const ReportInput& clip : clips) {
    ReportClip data = MakeReportClip(clip, options.contact_threshold_mm, options.threads);
    page.directions = std::max(page.directions, data.directions);
    page.surface_error_mm = std::max(page.surface_error_mm, data.surface_error_mm);
    header["clips"].push_back(std::move(data.header));
    payloads.push_back(data.payload.Encode());
    const int done = static_cast<int>(payloads.size());
    if (progress && !progress("report", done, static_cast<int>(clips.size()))) return page;
  }
  page.html = PageOf(header, payloads);
  return page;
}

std::string EscapeHtml(std::string_view text) {
  constexpr std::string_view kSpecial = "&<>\"'";
  constexpr const char* kEntities[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
  std::string escaped;
  for (const char c : AsUtf8(text)) {
    const std::size_t which = kSpecial.find(c);
    which == std::string_view::npos ? escaped += c : escaped += kEntities[which];
  }
  return escaped;
}

}  // namespace holdfast
