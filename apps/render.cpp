// SPDX-License-Identifier: MIT
#include <charconv>
#include <mutex>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "apps/common.h"
#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/render/clip_renderer.h"
#include "geometry/render/contact_sheet.h"
#include "geometry/render/png.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct Options {
  CommonOptions common;
  std::string clip;
  std::string output;
  std::string object;
  std::string body;
  std::string view = "front";
  std::string size = "640x480";
  std::string sheet;
  std::optional<int> frame;
  int every = 1;
  int supersampling = 2;
  std::optional<double> azimuth_deg, elevation_deg;
  bool no_contact = false;
};

constexpr int kMaxSide = 16384;  // pixels, or tiles

// "640x480" to a pair of positive numbers.
std::optional<std::pair<int, int>> ParsePair(const std::string& text) {
  int a = 0;
  int b = 0;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, a);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != 'x') return std::nullopt;
  const auto second = std::from_chars(first.ptr + 1, end, b);
  if (second.ec != std::errc() || second.ptr != end || a < 1 || b < 1) return std::nullopt;
  if (a > kMaxSide || b > kMaxSide) return std::nullopt;
  return std::pair(a, b);
}

// A file name with one %d or %0Nd in it, for numbered pictures.
struct Pattern {
  std::string before, after;
  int digits = 1;

  std::string Name(int number) const {
    return fmt::format("{}{:0{}}{}", before, number, digits, after);
  }
};

std::optional<Pattern> ParsePattern(const std::string& name) {
  const auto percent = name.find('%');
  if (percent == std::string::npos) return std::nullopt;
  const auto letter = name.find('d', percent);
  Pattern pattern;
  if (letter != std::string::npos) {
    const std::string width = name.substr(percent + 1, letter - percent - 1);
    const auto [end, fault] =
        std::from_chars(width.data(), width.data() + width.size(), pattern.digits);
    pattern.before = name.substr(0, percent);
    pattern.after = name.substr(letter + 1);
    const bool number = fault == std::errc() && end == width.data() + width.size();
    if ((width.empty() || number) && pattern.digits >= 0 && pattern.digits <= 9 &&
        pattern.after.find('%') == std::string::npos) {
      return pattern;
    }
  }
  throw Error(name, "is not a pattern for numbered pictures", "Write it like frame_%03d.png");
}

// The object's mesh: as told, else the file the clip names, else the embedded object of its name.
std::optional<TriangleMesh> ObjectOf(const Clip& clip, const Options& options) {
  if (!options.object.empty()) return LoadObject(options.object).mesh;
  if (!clip.object) return std::nullopt;
  std::vector<std::string> candidates;
  if (!clip.object->mesh.empty()) {
    candidates.push_back((fs::path(options.clip).parent_path() / clip.object->mesh).string());
  }
  if (!clip.object->name.empty()) candidates.push_back(clip.object->name);
  for (const std::string& candidate : candidates) {
    try {
      return LoadObject(candidate).mesh;
    } catch (const Error&) {
      continue;
    }
  }
  Note(options.common, fmt::format("note: the mesh of the clip's object ('{}') was not found: the "
                                   "body is drawn alone (--object MESH gives one)",
                                   clip.object->mesh));
  return std::nullopt;
}

// The frames of a sheet: first, last and evenly between, or the one asked for.
std::vector<int> ChooseFrames(const Options& options, int num_frames, int tiles, bool numbered) {
  if (options.frame) return {*options.frame};
  std::vector<int> frames;
  if (numbered) {
    for (int t = 0; t < num_frames; t += options.every) frames.push_back(t);
    return frames;
  }
  const int count = std::min(tiles, num_frames);
  for (int k = 0; k < count; ++k) {
    frames.push_back(count == 1 ? 0 : k * (num_frames - 1) / (count - 1));
  }
  return frames;
}

// Draws the frames on several threads and hands each to `done` (any order, never two at once).
template <typename Done>
void DrawFrames(const ClipRenderer& renderer, const ClipRenderOptions& how,
                const std::vector<int>& frames, const CommonOptions& common, Done&& done) {
  Progress progress(common, "render");
  std::mutex lock;
  int finished = 0;
  ParallelFor(static_cast<int>(frames.size()), NumThreads(common), [&](int k) {
    if (Interrupted()) return;
    Image image = renderer.Draw(frames[k], how);
    const std::scoped_lock guard(lock);
    done(static_cast<std::size_t>(k), std::move(image));
    progress.Update(++finished, static_cast<int>(frames.size()));
  });
}

int Run(const Options& options) {
  const CommonOptions& common = options.common;
  const std::optional<Pattern> pattern = ParsePattern(options.output);
  const Clip clip = LoadClip(options.clip);
  const auto body = LoadBody(options.body);
  const std::optional<TriangleMesh> object = ObjectOf(clip, options);
  const ClipRenderer renderer(clip, body, BetasFor(clip, *body, common),
                              object ? &*object : nullptr);

  ClipRenderOptions how;
  std::tie(how.picture.width, how.picture.height) = *ParsePair(options.size);
  how.picture.supersampling = options.supersampling;
  how.view = *ParseClipView(options.view);
  how.show_contact = !options.no_contact;
  constexpr double kDegree = std::numbers::pi / 180.0;
  if (options.azimuth_deg) how.azimuth_rad = *options.azimuth_deg * kDegree;
  if (options.elevation_deg) how.elevation_rad = *options.elevation_deg * kDegree;

  const auto [columns, rows] = ParsePair(options.sheet).value_or(std::pair(4, 2));
  const std::vector<int> frames =
      ChooseFrames(options, clip.NumFrames(), columns * rows, pattern.has_value());
  const auto name = [&](std::size_t k) {
    return pattern ? pattern->Name(frames[k]) : options.output;
  };
  for (std::size_t k = 0; k < (pattern ? frames.size() : 1); ++k) RequireNew(name(k), common);

  std::vector<Image> tiles(pattern ? 0 : frames.size());
  DrawFrames(renderer, how, frames, common, [&](std::size_t k, Image image) {
    if (pattern) {
      WritePng(image, name(k));
    } else {
      tiles[k] = std::move(image);
    }
  });
  if (Interrupted()) return kInterrupted;
  if (!pattern) {
    std::vector<std::string> labels;
    for (const int t : frames) labels.push_back(fmt::format("{:.2f} s", t / clip.frame_rate));
    WritePng(frames.size() == 1 ? tiles[0] : ContactSheet(tiles, labels, columns), options.output);
  }

  nlohmann::json summary = JsonHead("holdfast/render/1", common);
  summary["output"] = options.output;
  summary["frames"] = frames;
  summary["size"] = {how.picture.width, how.picture.height};
  PrintResult(
      common, summary,
      fmt::format("{}: {} of {} frames\n", options.output, frames.size(), clip.NumFrames()));
  return kDone;
}

}  // namespace

void AddRenderCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "render",
      "Pictures of a clip: body, object, and where the hands touch it (no GPU, no display)");
  const auto pair = [](const std::string& text) {
    return ParsePair(text) ? std::string()
                           : "'" + text + "' is not two numbers (1 to 16384) like 640x480";
  };
  command->add_option("clip", options->clip, "Clip (.npz) or embedded clip")->required();
  command
      ->add_option("-o,--output", options->output,
                   "A .png: one picture or a sheet; with %d or %03d in it: one per frame")
      ->required();
  command->add_option("--object", options->object,
                      "Mesh or embedded object in place of the one the clip names");
  command->add_option("--body", options->body, "SMPL-X model file in place of the embedded body");
  command->add_option("--camera", options->view, "front, side, follow or hand")
      ->capture_default_str()
      ->check(CLI::IsMember({"front", "side", "follow", "hand"}));
  command->add_option("--azimuth", options->azimuth_deg,
                      "Turn the camera: degrees from the front, to the person's left positive");
  command->add_option("--elevation", options->elevation_deg, "Raise the camera: degrees");
  command->add_option("--sheet", options->sheet, "Columns and rows of the sheet (4x2)")
      ->check(pair);
  command->add_option("--frame", options->frame, "Only this frame, from 0")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--every", options->every, "For numbered pictures: every n-th frame")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  command->add_option("--size", options->size, "Pixels of each picture")
      ->capture_default_str()
      ->check(pair);
  command->add_option("--supersampling", options->supersampling, "Samples per pixel and side")
      ->capture_default_str()
      ->check(CLI::Range(1, 4));
  command->add_flag("--no-contact", options->no_contact, "Do not colour where the hands touch");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast render demo_drink -o drink.png --sheet 6x2 --size 240x400\n"
                   "  holdfast render held/clip.npz -o hand_%03d.png --camera hand\n"
                   "Amber: skin within 3 mm of the object. Red: skin inside it.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
