// SPDX-License-Identifier: MIT
#include <memory>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "geometry/render/clip_pictures.h"
#include "geometry/report/report_data.h"
#include "solver/markers/marker_json.h"

namespace holdfast::apps {
namespace {

struct RenderCommand {
  CommonOptions common;
  std::string clip;
  std::string output;
  std::string markers;
  ClipInputOptions input;
  ClipPictureOptions pictures;
};

int Run(const RenderCommand& options) {
  const CommonOptions& common = options.common;
  const PictureFile file = PictureFileOf(options.output);
  if (!file.numbered) RequireNew(options.output, common);
  const ClipInput input = LoadClipInput(options.clip, options.input, common);
  const Clip& clip = input.clip;
  if (clip.object && !input.object) {
    Note(common, fmt::format("note: the mesh of the clip's object was not found, so only the body "
                             "is drawn (give the mesh with --object MESH). {}",
                             input.object_missing));
  }
  const ClipRenderer renderer(clip, input.body, input.betas,
                              clip.object && input.object ? &*input.object : nullptr);
  ClipPictureOptions how = options.pictures;
  how.threads = NumThreads(common);
  if (!options.markers.empty()) how.how.markers = MeasuredMarkers(options.markers);
  how.how.goals = GoalsIn(input.metrics);
  const ClipPictures pictures = PlanPictures(clip, file, how);
  if (!pictures.note.empty()) Note(common, "note: " + pictures.note);
  if (file.numbered) {
    for (const int frame : pictures.frames) RequireNew(file.numbered->Name(frame), common);
  }
  Progress progress(common, "render");
  const bool drawn = WritePictures(renderer, pictures, [&](int done, int total) {
    progress.Update(done, total);
    return !Interrupted();
  });
  if (!drawn) return kInterrupted;

  nlohmann::json summary = JsonHead("holdfast/render/1", common);
  summary["output"] = options.output;
  summary["frames"] = pictures.frames;
  summary["size"] = {pictures.how.picture.width, pictures.how.picture.height};
  if (file.video) summary["frame_rate_hz"] = pictures.frame_rate;
  PrintResult(common, summary,
              fmt::format("{}: {} of {} frames\n", options.output, pictures.frames.size(),
                          clip.NumFrames()));
  return kDone;
}

}  // namespace

void AddRenderCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<RenderCommand>();
  CLI::App* command = app.add_subcommand(
      "render", "Render a clip: body, object and hand contacts (no GPU, no display)");
  command->add_option("clip", options->clip, kClipHelp)->required();
  command
      ->add_option("-o,--output", options->output,
                   ".png: one picture or a sheet; with %d or %03d in the name: one picture per "
                   "frame; .gif or .mp4: a video (needs ffmpeg)")
      ->required();
  AddClipInputOptions(*command, options->input);
  AddOptions(*command, OptionsOf(options->pictures));
  command->get_option("--fps")->excludes(command->get_option("--every"));
  command->add_option("--markers", options->markers,
                      "Result folder of 'holdfast solve': also draw the measured markers, if the "
                      "recording is still available");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast render demo_drink -o drink.png --sheet 6x2 --size 240x400\n"
                   "  holdfast render held -o hand_%03d.png --camera hand\n"
                   "  holdfast render held -o held.mp4 --size 1280x720 --camera follow\n"
                   "  holdfast render solved -o solved.mp4 --markers solved\n"
                   "Amber: skin within 3 mm of the object. Red: skin inside it.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
