// SPDX-License-Identifier: MIT
#include <algorithm>
#include <functional>
#include <mutex>
#include <optional>
#include <span>

#include <fmt/format.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "apps/render_output.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/io/container/read_json.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/numbered_name.h"
#include "geometry/parallel.h"
#include "geometry/render/clip_renderer.h"
#include "geometry/render/contact_sheet.h"
#include "geometry/render/png.h"
#include "geometry/render/video.h"
#include "geometry/rotation.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

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

// Draws these frames on several threads; nothing (empty) after Ctrl-C.
std::vector<Image> Draw(const ClipRenderer& renderer, const ClipRenderOptions& how,
                        std::span<const int> frames, const CommonOptions& common,
                        const std::function<void()>& drawn) {
  std::vector<Image> images(frames.size());
  std::mutex lock;
  ParallelFor(static_cast<int>(frames.size()), NumThreads(common), [&](int k) {
    if (Interrupted()) return;
    images[k] = renderer.Draw(frames[k], how);
    const std::scoped_lock guard(lock);
    drawn();
  });
  if (Interrupted()) images.clear();
  return images;
}

// The markers of the recording that a folder was solved from, where solve put them in the world.
Eigen::MatrixXd MeasuredMarkers(const fs::path& folder) {
  const fs::path path = folder / "metrics.json";
  const nlohmann::json metrics = ReadJson(path);
  if (!metrics.is_object() || metrics.value("schema", "") != "holdfast/solve/1") {
    throw Error(folder.string(), "is no folder that 'holdfast solve' made",
                "Give one with its metrics.json");
  }
  return UseJson(path, [&] {
    const nlohmann::json& world = metrics.at("world");
    Eigen::Matrix3d R;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) R(i, j) = world.at("rotation").at(i).at(j).get<double>();
    }
    R *= world.at("scale").get<double>();
    const Eigen::Vector3d lift(0.0, 0.0, world.at("lift_m").get<double>());
    MarkerRecording recording =
        ReadMarkers(metrics.at("options").at("recording").get<std::string>());
    Eigen::Map<Eigen::Matrix3Xd> points(recording.positions.data(), 3,
                                        recording.positions.size() / 3);
    points = ((R * points).colwise() + lift).eval();
    return recording.positions;
  });
}

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

// The frame rate of a video: as told, else the clip's, as far as the format has it.
double VideoRate(const RenderCommand& options, VideoFormat format, double clip_frame_rate) {
  const double rate = options.fps.value_or(clip_frame_rate / options.every);
  if (format != VideoFormat::kGif || rate <= kMaxGifRate) return rate;
  Note(options.common, fmt::format("note: a .gif shows {0:g} frames per second at most: {0:g} in "
                                   "place of {1:g}",
                                   kMaxGifRate, rate));
  return kMaxGifRate;
}

// What is written: a video, numbered pictures, or with neither one picture or sheet.
struct RenderTarget {
  std::optional<VideoFormat> video;
  std::optional<NumberedName> numbered;
};

// By the output's name. Throws Error for names that are no picture's, and for a file that is there.
RenderTarget RenderTargetOf(const RenderCommand& options) {
  const std::optional<VideoFormat> video = VideoFormatOf(options.output);
  const std::optional<NumberedName> numbered = ParseNumberedName(options.output);
  if (video && numbered) {
    throw Error(options.output, "is one file, not numbered pictures", "Leave the % out");
  }
  if (!video && !EqualIgnoringCase(fs::path(options.output).extension().string(), ".png")) {
    throw Error(options.output, "is not a supported picture format",
                "Give a name in .png, .gif or .mp4");
  }
  if (!numbered) RequireNew(options.output, options.common);
  return {video, numbered};
}

// The frames to draw, and the rate of a video of them.
struct RenderedFrames {
  std::vector<int> frames;
  double rate = 0.0;
};

RenderedFrames FramesToRender(const RenderCommand& options, const RenderTarget& target,
                              const Clip& clip, int tiles) {
  if (options.frame) return {{*options.frame}, 1.0};
  if (target.video) {
    const double rate = VideoRate(options, *target.video, clip.frame_rate);
    return {FramesAtRate(clip.NumFrames(), clip.frame_rate, rate), rate};
  }
  if (target.numbered) return {EveryFrame(clip.NumFrames(), options.every), 0.0};
  return {EvenFrames(clip.NumFrames(), tiles), 0.0};
}

void WriteNumberedPictures(const NumberedName& name, const std::vector<int>& frames, int batch,
                           const DrawFrames& draw) {
  for (std::size_t k = 0; k < frames.size() && !Interrupted(); k += batch) {
    const std::size_t count = std::min<std::size_t>(batch, frames.size() - k);
    const std::vector<Image> images = draw({frames.data() + k, count});
    for (std::size_t i = 0; i < images.size(); ++i) {
      WritePng(images[i], name.Name(frames[k + i]));
    }
  }
}

// Draws the frames and writes them; stops after Ctrl-C.
void WritePictures(const RenderCommand& options, const RenderTarget& target,
                   const RenderedFrames& shown, double clip_frame_rate, int columns,
                   const DrawFrames& draw) {
  const std::vector<int>& frames = shown.frames;
  const int batch = 2 * NumThreads(options.common);  // keeps memory small, and the threads busy
  if (target.video) {
    WriteVideo(options.output, static_cast<int>(frames.size()), {shown.rate, batch},
               [&](std::span<const int> indices) {
                 std::vector<int> which;
                 for (const int k : indices) which.push_back(frames[k]);
                 return draw(which);
               });
  } else if (target.numbered) {
    WriteNumberedPictures(*target.numbered, frames, batch, draw);
  } else if (const std::vector<Image> tiles = draw(frames); !tiles.empty()) {
    std::vector<std::string> labels;
    for (const int t : frames) labels.push_back(fmt::format("{:.2f} s", t / clip_frame_rate));
    WritePng(tiles.size() == 1 ? tiles[0] : ContactSheet(tiles, labels, columns), options.output);
  }
}

int Run(const RenderCommand& options) {
  const CommonOptions& common = options.common;
  const RenderTarget target = RenderTargetOf(options);
  const ClipInput input = LoadClipInput(options.clip, options.input, common);
  const Clip& clip = input.clip;
  if (clip.object && !input.object) {
    Note(common, fmt::format("note: the mesh of the clip's object was not found: the body is drawn "
                             "alone (--object MESH gives one). {}",
                             input.object_missing));
  }
  const ClipRenderer renderer(clip, input.body, input.betas,
                              clip.object && input.object ? &*input.object : nullptr,
                              input.table ? &*input.table : nullptr);
  const bool sheet = !options.frame && !target.video && !target.numbered;
  ClipRenderOptions how = HowToDraw(options, sheet ? SheetView(clip) : ClipView::kFront);
  const auto [columns, rows] = ParsePair(options.sheet).value_or(std::pair(4, 2));

  const RenderedFrames shown = FramesToRender(options, target, clip, columns * rows);
  const std::vector<int>& frames = shown.frames;
  if (target.video == VideoFormat::kMp4) {  // its colours are stored for two by two pixels
    how.picture.width += how.picture.width % 2;
    how.picture.height += how.picture.height % 2;
  }
  if (target.numbered) {
    for (const int frame : frames) RequireNew(target.numbered->Name(frame), common);
  }

  Progress progress(common, "render");
  int drawn = 0;
  WritePictures(options, target, shown, clip.frame_rate, columns, [&](std::span<const int> which) {
    return Draw(renderer, how, which, common, [&] {
      progress.Update(++drawn, std::max(drawn, static_cast<int>(frames.size())));
    });
  });
  if (Interrupted()) return kInterrupted;

  nlohmann::json summary = JsonHead("holdfast/render/1", common);
  summary["output"] = options.output;
  summary["frames"] = frames;
  summary["size"] = {how.picture.width, how.picture.height};
  if (target.video) summary["frame_rate_hz"] = shown.rate;
  PrintResult(
      common, summary,
      fmt::format("{}: {} of {} frames\n", options.output, frames.size(), clip.NumFrames()));
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
                   "A .png: one picture or a sheet; with %d or %03d in it: one per frame. "
                   "A .gif or .mp4: a video (made by ffmpeg)")
      ->required();
  AddClipInputOptions(*command, options->input);
  command
      ->add_option("--camera", options->view,
                   "front, side, follow or hand [front; follow for a sheet of a walking person]")
      ->check(CLI::IsMember({"front", "side", "follow", "hand"}));
  command->add_option("--azimuth", options->azimuth_deg,
                      "Turn the camera: degrees from the front, to the person's left positive");
  command->add_option("--elevation", options->elevation_deg, "Raise the camera: degrees");
  command->add_option("--sheet", options->sheet, "Columns and rows of the sheet (4x2)")
      ->check(pair);
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
  AddOption(*command, "--size", options->size, "Pixels of each picture", pair);
  AddOption(*command, "--supersampling", options->supersampling, "Samples per pixel and side",
            CLI::Range(1, 4));
  command->add_option(
      "--markers", options->markers,
      "Folder that 'holdfast solve' made: the measured markers are drawn too, where "
      "its recording is");
  command->add_flag("--no-contact", options->no_contact, "Do not colour where the hands touch");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast render demo_drink -o drink.png --sheet 6x2 --size 240x400\n"
                   "  holdfast render held -o hand_%03d.png --camera hand\n"
                   "  holdfast render held -o held.mp4 --size 1280x720 --camera follow\n"
                   "  holdfast render solved -o solved.mp4 --markers solved\n"
                   "Amber: skin within 3 mm of the object. Red: skin inside it.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
