// SPDX-License-Identifier: MIT
#include "geometry/render/clip_pictures.h"

#include <algorithm>
#include <mutex>
#include <span>
#include <string>

#include <fmt/format.h>

#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/parallel.h"
#include "geometry/render/contact_sheet.h"
#include "geometry/render/png.h"

namespace holdfast {
namespace {

// Draws frames and tells of each; after the first false it draws none.
class Drawing {
 public:
  Drawing(const ClipRenderer& renderer, const ClipPictures& pictures,
          const std::function<bool(int, int)>& progress)
      : renderer_(renderer), pictures_(pictures), progress_(progress) {}

  bool Stopped() const { return stopped_; }

  // Frames are places in the list of those to draw; nothing (empty) once stopped.
  std::vector<Image> operator()(std::span<const int> places) {
    std::vector<Image> images(places.size());
    ParallelFor(static_cast<int>(places.size()), pictures_.threads, [&](int k) {
      if (std::scoped_lock guard(lock_); stopped_) return;
      images[k] = renderer_.Draw(pictures_.frames[places[k]], pictures_.how);
      const std::scoped_lock guard(lock_);
      if (stopped_) return;
      ++done_;
      const int total = std::max(done_, static_cast<int>(pictures_.frames.size()));
      if (progress_ && !progress_(done_, total)) stopped_ = true;
    });
    if (stopped_) images.clear();
    return images;
  }

 private:
  const ClipRenderer& renderer_;
  const ClipPictures& pictures_;
  const std::function<bool(int, int)>& progress_;
  std::mutex lock_;
  int done_ = 0;
  bool stopped_ = false;
};

std::vector<int> AllPlaces(const ClipPictures& pictures) {
  std::vector<int> places(pictures.frames.size());
  for (std::size_t k = 0; k < places.size(); ++k) places[k] = static_cast<int>(k);
  return places;
}

void WriteNumbered(const ClipPictures& pictures, int batch, Drawing& draw) {
  const std::vector<int> places = AllPlaces(pictures);
  for (std::size_t k = 0; k < places.size(); k += static_cast<std::size_t>(batch)) {
    const std::size_t count = std::min<std::size_t>(batch, places.size() - k);
    const std::vector<Image> images = draw({places.data() + k, count});
    if (images.empty()) return;
    for (std::size_t i = 0; i < count; ++i) {
      WritePng(images[i], pictures.file.numbered->Name(pictures.frames[k + i]));
    }
  }
}

}  // namespace

PictureFile PictureFileOf(const std::filesystem::path& path) {
  PictureFile file{path, VideoFormatOf(path), ParseNumberedName(path.string())};
  if (file.video && file.numbered) {
    throw Error(path.string(), "is one file, not numbered pictures", "Leave the % out");
  }
  if (!file.video && !EqualIgnoringCase(path.extension().string(), ".png")) {
    throw Error(path.string(), "is not a supported picture format",
                "Give a name in .png, .gif or .mp4");
  }
  return file;
}

ClipPictures PlanPictures(const Clip& clip, const PictureFile& file,
                          const ClipPictureOptions& options) {
  ClipPictures out;
  out.file = file;
  out.how = options.how;
  out.columns = options.columns;
  out.threads = options.threads;
  const int frames = clip.NumFrames();
  if (options.frame) {
    out.frames = {*options.frame};
    out.frame_rate = 1.0;
  } else if (file.video) {
    out.frame_rate = options.frame_rate.value_or(clip.frame_rate / options.every);
    if (file.video == VideoFormat::kGif) out.frame_rate = std::min(out.frame_rate, kMaxGifRate);
    out.frames = FramesAtRate(frames, clip.frame_rate, out.frame_rate);
  } else if (file.numbered) {
    out.frames = EveryFrame(frames, options.every);
  } else {
    out.frames = EvenFrames(frames, options.columns * options.rows);
  }
  if (file.video == VideoFormat::kMp4) {  // its colours are stored for two by two pixels
    out.how.picture.width += out.how.picture.width % 2;
    out.how.picture.height += out.how.picture.height % 2;
  }
  return out;
}

bool WritePictures(const ClipRenderer& renderer, const ClipPictures& pictures,
                   const std::function<bool(int, int)>& progress) {
  Drawing draw(renderer, pictures, progress);
  const int batch = 2 * pictures.threads;  // keeps memory small, and the threads busy
  const PictureFile& file = pictures.file;
  if (file.video) {
    WriteVideo(file.path, static_cast<int>(pictures.frames.size()), {pictures.frame_rate, batch},
               [&](std::span<const int> places) { return draw(places); });
  } else if (file.numbered) {
    WriteNumbered(pictures, batch, draw);
  } else if (const std::vector<Image> tiles = draw(AllPlaces(pictures)); !tiles.empty()) {
    std::vector<std::string> labels;
    for (const int t : pictures.frames) {
      labels.push_back(fmt::format("{:.2f} s", t / renderer.GetClip().frame_rate));
    }
    WritePng(tiles.size() == 1 ? tiles[0] : ContactSheet(tiles, labels, pictures.columns),
             file.path);
  }
  return !draw.Stopped();
}

}  // namespace holdfast
