// SPDX-License-Identifier: MIT
#include "apps/report_writer.h"

#include <vector>

#include <fmt/format.h>

#include "apps/report_page.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/report/report_data.h"

namespace holdfast::apps {
namespace {

// "mug, demo_drink": the object, and the motion it was fitted to.
std::string TitleOf(std::span<const ClipInput> clips) {
  std::string title;
  for (const ClipInput& clip : clips) {
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

}  // namespace

ReportSize WriteReport(std::span<const ClipInput> clips, const std::filesystem::path& path,
                       const ReportOptions& options, const CommonOptions& common) {
  if (clips.empty()) throw Error(path.string(), "is to show no clip", "Give a clip or more");
  RequirePlayer();
  nlohmann::json header = JsonHead("holdfast/report/1", common);
  header["title"] = options.title.empty() ? TitleOf(clips) : options.title;
  header["clips"] = nlohmann::json::array();
  std::vector<std::string> payloads;
  ReportSize size;
  Progress progress(common, "report");
  for (const ClipInput& clip : clips) {
    if (Interrupted()) return size;
    ReportClip data = MakeReportClip(clip, options.contact_threshold_mm, NumThreads(common));
    size.directions = std::max(size.directions, data.directions);
    size.surface_error_mm = std::max(size.surface_error_mm, data.surface_error_mm);
    header["clips"].push_back(std::move(data.header));
    payloads.push_back(data.payload.Encode());
    progress.Update(static_cast<int>(payloads.size()), static_cast<int>(clips.size()));
  }
  const std::string page = ReportPage(header, payloads);
  size.bytes = page.size();
  WriteAtomically(path, page);
  return size;
}

void WriteReportBeside(std::span<const ClipInput> clips, const std::filesystem::path& path,
                       const CommonOptions& common) {
  if (HasReportPlayer()) {
    WriteReport(clips, path, {}, common);
  } else {
    Note(common, "note: no report.html: this program was built without the player");
  }
}

}  // namespace holdfast::apps
