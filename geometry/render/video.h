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

/// More than this, and programs that show a .gif fall back to ten frames a second.
inline constexpr double kMaxGifRate = 50.0;

/// By extension, in capitals or not; nothing for another one.
std::optional<VideoFormat> VideoFormatOf(const std::filesystem::path& path);

struct VideoOptions {
  double frame_rate = 30.0;  ///< frames per second
  int batch = 4;             ///< frames asked for at once, and the most that are held in memory
};

/// Draws the frames of these indices, in their order; nothing (empty) to stop.
using DrawFrames = std::function<std::vector<Image>(std::span<const int>)>;

/// Encodes frames 0 .. num_frames - 1, which are asked for in order, through the program `ffmpeg`
/// (found in PATH, started without a shell). A .gif asks for some frames twice: its palette is
/// made of a few of them first, so that no more than a batch is ever in memory. The file appears
/// whole or not at all, and the same frames give the same bytes with the same ffmpeg. Returns false
/// when `draw` stopped: there is no file then.
///
/// Throws Error when `path` has no extension of a video, the frame rate is not positive (or above
/// kMaxGifRate in a .gif), sizes differ or are odd in an .mp4, ffmpeg is not installed, or fails:
/// then with the last lines that it said.
bool WriteVideo(const std::filesystem::path& path, int num_frames, const VideoOptions& options,
                const DrawFrames& draw);

/// The program ffmpeg, reading from us. It is in a process group of its own: Ctrl-C reaches us and
/// not it. Destroyed before Finish(), it is ended.
class FfmpegProcess {
 public:
  /// Starts `ffmpeg arguments...`. Throws Error when it is not installed or cannot be started.
  explicit FfmpegProcess(const std::vector<std::string>& arguments);
  ~FfmpegProcess();
  FfmpegProcess(const FfmpegProcess&) = delete;
  FfmpegProcess& operator=(const FfmpegProcess&) = delete;

  /// Hands it bytes. Throws Error, with what it said, when it has ended.
  void Write(std::span<const std::uint8_t> bytes);

  /// Says that there is no more, and waits for its end. Throws Error, with what it said, when it
  /// failed.
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
