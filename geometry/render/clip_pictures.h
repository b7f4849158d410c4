// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "geometry/numbered_name.h"
#include "geometry/render/clip_renderer.h"
#include "geometry/render/video.h"

namespace holdfast {

/// What pictures of a clip are written to, by its name: a video (.gif, .mp4), numbered pictures
/// (a .png with %d or %03d in it), or with neither one picture or a sheet of them (.png).
struct PictureFile {
  std::filesystem::path path;
  std::optional<VideoFormat> video;
  std::optional<NumberedName> numbered;
};

/// Throws Error for a name that is neither a picture's nor a video's, or a numbered video's.
PictureFile PictureFileOf(const std::filesystem::path& path);

struct ClipPictureOptions {
  ClipRenderOptions how;
  std::optional<int> frame;          ///< this one alone, 0-based
  int every = 1;                     ///< numbered pictures and videos: every n-th frame
  std::optional<double> frame_rate;  ///< of a video, Hz; else the clip's, divided by `every`
  int columns = 4, rows = 2;         ///< of a sheet: its frames lie evenly through the clip
  int threads = 1;
};

/// Which frames are drawn, and how: sizes are even and the rate is at most kMaxGifRate where the
/// format of a video asks for that.
struct ClipPictures {
  PictureFile file;
  ClipRenderOptions how;
  std::vector<int> frames;
  double frame_rate = 0.0;  ///< of a video, Hz
  int columns = 1, threads = 1;
};
ClipPictures PlanPictures(const Clip& clip, const PictureFile& file,
                          const ClipPictureOptions& options);

/// Draws the frames, on several threads, and writes them; a batch at a time where they are a video
/// or numbered. `progress(done, total)` is called after each picture, from one thread at a time
/// (a .gif draws some twice: total grows), and stops all by false. Returns false then: no video or
/// sheet is there, and no more than the numbered pictures until then. Throws Error as ClipRenderer
/// and WriteVideo do.
bool WritePictures(const ClipRenderer& renderer, const ClipPictures& pictures,
                   const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
