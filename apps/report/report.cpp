// SPDX-License-Identifier: MIT
#include <chrono>
#include <vector>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/output.h"

namespace holdfast::apps {
namespace {

struct ReportCommand {
  CommonOptions common;
  ClipInputOptions input;
  ReportPageOptions report;
  std::vector<std::string> clips;
  std::string output;
};

int Run(const ReportCommand& options) {
  const CommonOptions& common = options.common;
  RequireNew(options.output, common);
  const auto begin = std::chrono::steady_clock::now();
  std::vector<ReportInput> clips;
  for (const std::string& clip : options.clips) {
    clips.push_back(LoadClipInput(clip, options.input, common));
    if (!clips.back().object_missing.empty()) {
      Note(common,
           fmt::format("note: {}: only the body is shown: {}", clip, clips.back().object_missing));
    }
  }
  const ReportPage page = WriteReport(clips, options.output, options.report, common);
  if (Interrupted()) return kInterrupted;
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();

  nlohmann::json summary = JsonHead("holdfast/report/1", common);
  summary["output"] = options.output;
  summary["clips"] = options.clips;
  summary["bytes"] = page.html.size();
  summary["surface_error_mm"] = page.surface_error_mm;
  summary["corrective_directions"] = page.directions;
  summary["made_ms"] = ms;
  PrintResult(common, summary,
              fmt::format("{}: {} clip{}, {:.1f} MB, made in {:.2f} s\n", options.output,
                          clips.size(), clips.size() == 1 ? "" : "s",
                          1e-6 * static_cast<double>(page.html.size()), 1e-3 * ms));
  return kDone;
}

}  // namespace

void AddReportCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReportCommand>();
  CLI::App* command = app.add_subcommand(
      "report", "Write a self-contained HTML page of a clip: 3D player, curves, provenance");
  command
      ->add_option("clips", options->clips,
                   "Result folders, clips or files that 'holdfast import' reads; the second is "
                   "overlaid on the first as a ghost")
      ->required();
  command->add_option("-o,--output", options->output, "The page (.html) to write")->required();
  AddOptions(*command, OptionsOf(options->report));
  AddClipInputOptions(*command, options->input);
  AddCommonOptions(*command, options->common, true,
                   "  holdfast report held -o report.html\n"
                   "  holdfast report held held_bottle -o compare.html --title 'Mug or bottle'\n"
                   "  holdfast report walk.npz -o walk.html\n"
                   "The page needs no network: send it, archive it, open it from disk.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
