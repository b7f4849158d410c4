// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
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

/// Number of frames that WriteVideo requests, those of a .gif's palette included.
int FramesRequested(VideoFormat format, int num_frames);

/// Encodes frames 0 .. num_frames - 1, requested in order, `batch` at once, with the program
/// `ffmpeg` (found in PATH, started without a shell). `draw` returns the frames of these indices,
/// in order, or an empty vector to stop. For a .gif, some frames are requested twice: its palette
/// is computed from a few of them first, so that at most one batch is in memory. The file is
/// written atomically, and is deterministic for the same ffmpeg. Returns false, without a file, if
/// `draw` stopped.
///
/// Throws Error if `path` has no video extension, the frame rate is not positive (or above
/// kMaxGifRate for a .gif), sizes differ or are odd for an .mp4, or ffmpeg is not installed or
/// fails (with its last lines of output).
bool WriteVideo(const std::filesystem::path& path, int num_frames, double frame_rate, int batch,
                const std::function<std::vector<Image>(std::span<const int>)>& draw);

}  // namespace holdfast
