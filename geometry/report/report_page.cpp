// SPDX-License-Identifier: MIT
#include "geometry/report/report_page.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include <fmt/format.h>
#include <libdeflate.h>

#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/io/container/json_file.h"
#include "geometry/report/report_data.h"

namespace holdfast {

nlohmann::json MetricsBeside(const std::filesystem::path& clip) {
  const std::filesystem::path path = clip.parent_path() / "metrics.json";
  std::error_code ignored;
  if (clip.filename() != "clip.npz" || !std::filesystem::is_regular_file(path, ignored)) {
    return nullptr;
  }
  nlohmann::json metrics = ReadJson(path);
  if (!metrics.is_object()) {
    throw Error(path.string(), "is not the JSON of a result", "Delete it, or generate it again");
  }
  return metrics;
}

OptionTable OptionsOf(ReportPageOptions& options) {
  OptionTable table;
  table.Text("title", options.title, "The page's title; empty: the names of object and motion");
  table.Number("contact_threshold", "mm", options.contact_threshold_mm, {0.1, 12.0},
               "Skin closer than this to the object is in contact, mm; used only for clips without "
               "metrics.json");
  return table;
}

namespace {

// The page and the section built by player/build.mjs; the page has markers for title and data.
constexpr std::string_view kPlayerPage = "player.html";
constexpr std::string_view kContactEditor = "contacts.html";
constexpr std::string_view kTitleMarker = "<!--holdfast:title-->";
constexpr std::string_view kDataMarker = "<!--holdfast:data-->";

std::string_view PlayerFile(std::string_view name) {
  if (!HasReportPlayer()) {
    throw Error("report", "this program was built without the player",
                "Install nodejs and npm and build with -DHOLDFAST_BUILD_PLAYER=ON");
  }
  const auto bytes = FindEmbedded(name).bytes;
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// In JSON, '<' only occurs in strings, where its escape is equivalent. Escaping it ensures that no
// text can close the enclosing script element.
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

// The elements that the page's script reads (player/decode.js).
std::string DataElements(const nlohmann::json& header, const std::vector<std::string>& payloads) {
  std::string text = "<script type=\"application/json\" id=\"report-header\">" +
                     JsonForScript(header) + "</script>\n";
  for (std::size_t k = 0; k < payloads.size(); ++k) {
    text += fmt::format("<script type=\"text/plain\" id=\"report-payload-{}\">", k);
    text += payloads[k];
    text += "</script>\n";
  }
  return text;
}

// The player's page with the header and one payload per clip.
std::string PageOf(const nlohmann::json& header, const std::vector<std::string>& payloads) {
  const std::string_view page = PlayerFile(kPlayerPage);
  const std::size_t title = page.find(kTitleMarker);
  const std::size_t data = page.find(kDataMarker);
  if (title == std::string_view::npos || data == std::string_view::npos || data < title) {
    throw std::logic_error("the player's page has no places for title and data");
  }
  std::string text(page.substr(0, title));
  text += EscapeHtml(header.at("title").get<std::string>());
  text += page.substr(title + kTitleMarker.size(), data - title - kTitleMarker.size());
  text += DataElements(header, payloads);
  text += page.substr(data + kDataMarker.size());
  return text;
}

}  // namespace

bool HasReportPlayer() { return HasEmbedded(kPlayerPage); }

ReportPage MakeReportPage(std::span<const ReportInput> clips, const ReportPageOptions& options,
                          const StagedProgress& progress) {
  if (clips.empty()) throw Error("report", "has no clip to show", "Give at least one clip");
  PlayerFile(kPlayerPage);  // fail before the work
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

namespace {

static_assert(std::endian::native == std::endian::little, "the page reads little-endian arrays");

template <typename T>
constexpr std::string_view TypeName() {
  if constexpr (std::is_same_v<T, float>) return "f32";
  if constexpr (std::is_same_v<T, std::int16_t>) return "i16";
  if constexpr (std::is_same_v<T, std::int8_t>) return "i8";
  if constexpr (std::is_same_v<T, std::uint32_t>) return "u32";
  if constexpr (std::is_same_v<T, std::uint16_t>) return "u16";
  if constexpr (std::is_same_v<T, std::uint8_t>) return "u8";
}

// RFC 4648, with padding.
std::string Base64(std::string_view bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text((bytes.size() + 2) / 3 * 4, '=');
  auto digit = text.begin();
  for (std::size_t i = 0; i < bytes.size(); i += 3, digit += 4) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t triple = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      triple = triple << 8 | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k <= n; ++k) {
      digit[static_cast<std::ptrdiff_t>(k)] = kDigits[triple >> (18 - 6 * k) & 63];
    }
  }
  return text;
}

}  // namespace

template <typename T>
void ReportPayload::Add(std::string_view name, std::span<const T> values, int stride) {
  bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');  // typed arrays must be aligned
  directory_[std::string(name)] = {{"type", TypeName<T>()},
                                   {"offset", bytes_.size()},
                                   {"count", values.size()},
                                   {"stride", stride}};
  bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

template void ReportPayload::Add(std::string_view, std::span<const float>, int);
template void ReportPayload::Add(std::string_view, std::span<const std::int16_t>, int);
template void ReportPayload::Add(std::string_view, std::span<const std::int8_t>, int);
template void ReportPayload::Add(std::string_view, std::span<const std::uint32_t>, int);
template void ReportPayload::Add(std::string_view, std::span<const std::uint16_t>, int);
template void ReportPayload::Add(std::string_view, std::span<const std::uint8_t>, int);

std::string ReportPayload::Encode() const {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(6), &libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::string deflated(libdeflate_zlib_compress_bound(compressor.get(), bytes_.size()), '\0');
  deflated.resize(libdeflate_zlib_compress(compressor.get(), bytes_.data(), bytes_.size(),
                                           deflated.data(), deflated.size()));
  return Base64(deflated);
}

std::string ContactEditor(nlohmann::json header, const ReportPayload& payload) {
  header["arrays"] = payload.Directory();
  return DataElements(header, {payload.Encode()}).append(PlayerFile(kContactEditor));
}

}  // namespace holdfast
