// SPDX-License-Identifier: MIT
#include "apps/report/report.h"

#include <chrono>
#include <vector>

#include <fmt/format.h>

#include "apps/report/report_data.h"
#include "apps/report/report_page.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"

namespace holdfast::apps {
namespace {

struct ReportCommand {
  CommonOptions common;
  ClipInputOptions input;
  ReportOptions report;
  std::vector<std::string> clips;
  std::string output;
};

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

int Run(const ReportCommand& options) {
  const CommonOptions& common = options.common;
  RequireNew(options.output, common);
  const auto begin = std::chrono::steady_clock::now();
  std::vector<ClipInput> clips;
  for (const std::string& clip : options.clips) {
    clips.push_back(LoadClipInput(clip, options.input, common));
    if (!clips.back().object_missing.empty()) {
      Note(common,
           fmt::format("note: {}: the body is shown alone: {}", clip, clips.back().object_missing));
    }
  }
  const ReportSize size = WriteReport(clips, options.output, options.report, common);
  if (Interrupted()) return kInterrupted;
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();

  nlohmann::json summary = JsonHead("holdfast/report/1", common);
  summary["output"] = options.output;
  summary["clips"] = options.clips;
  summary["bytes"] = size.bytes;
  summary["surface_error_mm"] = size.surface_error_mm;
  summary["corrective_directions"] = size.directions;
  summary["made_ms"] = ms;
  PrintResult(
      common, summary,
      fmt::format("{}: {} clip{}, {:.1f} MB, made in {:.2f} s\n", options.output, clips.size(),
                  clips.size() == 1 ? "" : "s", 1e-6 * static_cast<double>(size.bytes), 1e-3 * ms));
  return kDone;
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
    ReportClip data = MakeReportClip(clip, options, NumThreads(common));
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

void AddReportCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReportCommand>();
  CLI::App* command = app.add_subcommand(
      "report", "Write a self-contained page of a clip: 3D player, curves, provenance");
  command
      ->add_option("clips", options->clips,
                   "Result folders, clips or files that 'holdfast import' reads; the second is "
                   "overlaid on the first as a ghost")
      ->required();
  command->add_option("-o,--output", options->output, "The page (.html) to write")->required();
  command->add_option("--title", options->report.title, "The page's title");
  command
      ->add_option("--contact-threshold", options->report.contact_threshold_mm,
                   "Skin this close to the object counts as contact, mm (clips without metrics)")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 12.0));
  AddClipInputOptions(*command, options->input);
  AddCommonOptions(*command, options->common, true,
                   "  holdfast report held -o report.html\n"
                   "  holdfast report held held_bottle -o compare.html --title 'Mug or bottle'\n"
                   "  holdfast report walk.npz -o walk.html\n"
                   "The page needs no network: send it, archive it, open it from disk.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
