// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/output.h"
#include "geometry/render/clip_pictures.h"
#include "geometry/rotation.h"
#include "solver/markers/marker_json.h"

namespace holdfast::apps {
namespace {

struct RenderCommand {
  CommonOptions common;
  std::string clip;
  std::string output;
  ClipInputOptions input;
  std::string view;
  std::string size = "640x480";
  std::string sheet;
  std::string markers;
  std::optional<int> frame;
  int every = 1;
  int supersampling = 2;
  std::optional<double> fps;
  std::optional<double> azimuth_deg, elevation_deg;
  bool no_contact = false;
};

ClipRenderOptions HowToDraw(const RenderCommand& options, ClipView usual) {
  ClipRenderOptions how;
  std::tie(how.picture.width, how.picture.height) = *ParsePair(options.size);
  how.picture.supersampling = options.supersampling;
  how.view = options.view.empty() ? usual : *ParseClipView(options.view);
  how.show_contact = !options.no_contact;
  if (!options.markers.empty()) how.markers = MeasuredMarkers(options.markers);
  if (options.azimuth_deg) how.azimuth_rad = *options.azimuth_deg * kDegree;
  if (options.elevation_deg) how.elevation_rad = *options.elevation_deg * kDegree;
  return how;
}

ClipPictures PicturesOf(const RenderCommand& options, const PictureFile& file, const Clip& clip) {
  const bool sheet = !options.frame && !file.video && !file.numbered;
  ClipPictureOptions how;
  how.how = HowToDraw(options, sheet ? SheetView(clip) : ClipView::kFront);
  how.frame = options.frame;
  how.every = options.every;
  how.frame_rate = options.fps;
  how.threads = NumThreads(options.common);
  std::tie(how.columns, how.rows) = ParsePair(options.sheet).value_or(std::pair(4, 2));
  const ClipPictures pictures = PlanPictures(clip, file, how);
  const double rate = options.fps.value_or(clip.frame_rate / options.every);
  if (file.video && !options.frame && pictures.frame_rate < rate) {
    Note(options.common,
         fmt::format(
             "note: a .gif shows at most {0:g} frames per second: using {0:g} instead of {1:g}",
             pictures.frame_rate, rate));
  }
  if (file.numbered) {
    for (const int frame : pictures.frames) RequireNew(file.numbered->Name(frame), options.common);
  }
  return pictures;
}

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
                              clip.object && input.object ? &*input.object : nullptr,
                              input.table ? &*input.table : nullptr);
  const ClipPictures pictures = PicturesOf(options, file, clip);
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
  const auto pair = [](const std::string& text) {
    return ParsePair(text) ? std::string()
                           : "'" + text + "' is not two numbers (1 to 16384) like 640x480";
  };
  command->add_option("clip", options->clip, kClipHelp)->required();
  command
      ->add_option("-o,--output", options->output,
                   ".png: one picture or a sheet; with %d or %03d in the name: one picture per "
                   "frame; .gif or .mp4: a video (needs ffmpeg)")
      ->required();
  AddClipInputOptions(*command, options->input);
  command
      ->add_option("--camera", options->view,
                   "front, side, follow or hand [front; follow for a sheet of a walking person]")
      ->check(CLI::IsMember({"front", "side", "follow", "hand"}));
  command->add_option("--azimuth", options->azimuth_deg,
                      "Azimuth of the camera: degrees from the front (follow, hand: from -y), "
                      "positive to the person's left");
  command->add_option("--elevation", options->elevation_deg, "Elevation of the camera, degrees");
  command->add_option("--sheet", options->sheet, "Columns x rows of the sheet [4x2]")->check(pair);
  command->add_option("--frame", options->frame, "Only this frame, from 0")
      ->check(CLI::NonNegativeNumber);
  CLI::Option* every =
      AddOption(*command, "--every", options->every,
                "Numbered pictures and videos: every n-th frame", CLI::PositiveNumber);
  command
      ->add_option("--fps", options->fps,
                   "Videos: frames per second, at the clip's speed [the clip's; .gif: at most 50]")
      ->check(CLI::Range(0.1, 240.0))
      ->excludes(every);
  AddOption(*command, "--size", options->size, "Width x height of each picture, pixels", pair);
  AddOption(*command, "--supersampling", options->supersampling,
            "Samples along each side of a pixel", CLI::Range(1, 4));
  command->add_option("--markers", options->markers,
                      "Result folder of 'holdfast solve': also draw the measured markers, if the "
                      "recording is still available");
  command->add_flag("--no-contact", options->no_contact, "Do not color contacts");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast render demo_drink -o drink.png --sheet 6x2 --size 240x400\n"
                   "  holdfast render held -o hand_%03d.png --camera hand\n"
                   "  holdfast render held -o held.mp4 --size 1280x720 --camera follow\n"
                   "  holdfast render solved -o solved.mp4 --markers solved\n"
                   "Amber: skin within 3 mm of the object. Red: skin inside it.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
