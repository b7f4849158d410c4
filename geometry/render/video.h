// SPDX-License-Identifier: MIT
#pragma once

#include <sys/types.h>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "geometry/render/image.h"

namespace holdfast {

enum class VideoFormat {
  kMp4,  ///< H.264, yuv420p in BT.709, index at the front: plays everywhere. Even sizes only.
  kGif,  ///< one palette for all frames, endless loop, at most kMaxGifRate
};

/// Above this rate, .gif viewers fall back to ten frames per second.
inline constexpr double kMaxGifRate = 50.0;

/// Returns the format by file extension, ignoring case; nothing for another extension.
std::optional<VideoFormat> VideoFormatOf(const std::filesystem::path& path);

struct VideoOptions {
  double frame_rate = 30.0;  ///< frames per second
  int batch = 4;             ///< frames requested at once, and the maximum held in memory
};

/// Draws the frames of these indices, in order; returns an empty vector to stop.
using DrawFrames = std::function<std::vector<Image>(std::span<const int>)>;

/// Encodes frames 0 .. num_frames - 1, requested in order, with the program `ffmpeg` (found in
/// PATH, started without a shell). For a .gif, some frames are requested twice: its palette is
/// computed from a few of them first, so that at most one batch is in memory. The file is written
/// atomically, and is deterministic for the same ffmpeg. Returns false, without a file, if `draw`
/// stopped.
///
/// Throws Error if `path` has no video extension, the frame rate is not positive (or above
/// kMaxGifRate for a .gif), sizes differ or are odd for an .mp4, or ffmpeg is not installed or
/// fails (with its last lines of output).
bool WriteVideo(const std::filesystem::path& path, int num_frames, const VideoOptions& options,
                const DrawFrames& draw);

/// An ffmpeg process that reads from this process. It has its own process group, so that Ctrl-C
/// does not reach it. It is terminated if destroyed before Finish().
class FfmpegProcess {
 public:
  /// Starts `ffmpeg arguments...`. Throws Error if it is not installed or cannot be started.
  explicit FfmpegProcess(const std::vector<std::string>& arguments);
  ~FfmpegProcess();
  FfmpegProcess(const FfmpegProcess&) = delete;
  FfmpegProcess& operator=(const FfmpegProcess&) = delete;

  /// Sends bytes. Throws Error, with ffmpeg's output, if it has exited.
  void Write(std::span<const std::uint8_t> bytes);

  /// Closes the input and waits for exit. Throws Error, with ffmpeg's output, if it failed.
  void Finish();

 private:
  [[noreturn]] void Fail();
  int Wait();

  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, CloseFile> said_;  // its stderr
  int input_ = -1;                              // our end of its stdin
  pid_t process_ = -1;
};

}  // namespace holdfast
