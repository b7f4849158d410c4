// SPDX-License-Identifier: MIT
#include "geometry/render/video.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/render/ffmpeg_process.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr int kPaletteFrames = 12;

// Leaves WriteAtomically without a file and without a fault.
struct Stopped {};

std::vector<std::string> Arguments(const fs::path& output, VideoFormat format, const Image& first,
                                   double frame_rate, int palette_frames) {
  // "file:" keeps a name with a colon or a leading dash a name. Bit-exact flags and a fixed number
  // of threads make the bytes depend on the frames alone.
  std::vector<std::string> arguments = {
      "-hide_banner",
      "-nostdin",
      "-loglevel",
      "error",
      "-y",
      "-f",
      "rawvideo",
      "-pixel_format",
      "rgb24",
      "-video_size",
      fmt::format("{}x{}", first.width, first.height),
      "-framerate",
      fmt::format("{:.6f}", frame_rate),
      "-i",
      "pipe:0",
      "-map_metadata",
      "-1",
      "-fflags",
      "+bitexact",
      "-flags",
      "+bitexact",
      "-threads",
      "4",
  };
  const auto add = [&](std::initializer_list<std::string> more) {
    arguments.insert(arguments.end(), more);
  };
  if (format == VideoFormat::kMp4) {
    add({"-vf", "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p", "-colorspace", "bt709",
         "-color_primaries", "bt709", "-color_trc", "bt709", "-c:v", "libx264", "-preset", "medium",
         "-crf", "18", "-movflags", "+faststart", "-f", "mp4"});
  } else {
    // The frames for the palette come first and are not shown.
    add({"-filter_complex",
         fmt::format("split[a][b];[a]trim=end_frame={0},palettegen=stats_mode=full[palette];"
                     "[b]trim=start_frame={0},setpts=PTS-STARTPTS[shown];"
                     "[shown][palette]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle",
                     palette_frames),
         "-loop", "0", "-f", "gif"});
  }
  arguments.push_back("file:" + output.string());
  return arguments;
}

void Require(const fs::path& path, VideoFormat format, int num_frames, double frame_rate) {
  if (num_frames < 1) {
    throw Error(path.string(), "has no frames", "Give a clip of at least one frame");
  }
  if (!(frame_rate > 0.0) || !std::isfinite(frame_rate)) {
    throw Error(path.string(), fmt::format("cannot have a frame rate of {}", frame_rate),
                "Give the frames per second");
  }
  if (format == VideoFormat::kGif && frame_rate > kMaxGifRate) {
    throw Error(path.string(), fmt::format("cannot have {:g} frames per second", frame_rate),
                fmt::format("A .gif shows {:g} at most", kMaxGifRate));
  }
}

}  // namespace

std::optional<VideoFormat> VideoFormatOf(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (EqualIgnoringCase(extension, ".mp4")) return VideoFormat::kMp4;
  if (EqualIgnoringCase(extension, ".gif")) return VideoFormat::kGif;
  return std::nullopt;
}

bool WriteVideo(const fs::path& path, int num_frames, const VideoOptions& options,
                const DrawFrames& draw) {
  const std::optional<VideoFormat> format = VideoFormatOf(path);
  if (!format) {
    throw Error(path.string(), "is not the name of a video", "Give a name in .mp4 or .gif");
  }
  Require(path, *format, num_frames, options.frame_rate);

  std::vector<int> order;
  const int palette_frames =
      *format == VideoFormat::kGif ? std::min(kPaletteFrames, num_frames) : 0;
  for (int k = 0; k < palette_frames; ++k) {
    order.push_back(palette_frames == 1 ? 0 : k * (num_frames - 1) / (palette_frames - 1));
  }
  for (int k = 0; k < num_frames; ++k) order.push_back(k);

  const auto encode = [&](const fs::path& temporary) {
    std::optional<FfmpegProcess> ffmpeg;
    int width = 0, height = 0;
    for (std::size_t begin = 0; begin < order.size();) {
      const std::size_t count =
          std::min(order.size() - begin, std::size_t(std::max(1, options.batch)));
      const std::vector<Image> images = draw({order.data() + begin, count});
      if (images.size() != count) throw Stopped();
      for (const Image& image : images) {
        if (!ffmpeg) {
          width = image.width;
          height = image.height;
          if (*format == VideoFormat::kMp4 && (width % 2 != 0 || height % 2 != 0)) {
            throw Error(path.string(), fmt::format("cannot have {} x {} pixels", width, height),
                        "An .mp4 has even numbers of them");
          }
          ffmpeg.emplace(Arguments(temporary, *format, image, options.frame_rate, palette_frames));
        }
        if (image.width != width || image.height != height) {
          throw Error(path.string(), "its frames differ in size", "Draw them in one size");
        }
        ffmpeg->Write(image.rgb);
      }
      begin += count;
    }
    ffmpeg->Finish();
  };
  try {
    WriteAtomically(path, encode);
  } catch (const Stopped&) {
    return false;
  }
  return true;
}

}  // namespace holdfast
