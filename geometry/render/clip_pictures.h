// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/render/rasterizer.h"
#include "geometry/render/video.h"
#include "geometry/suggestion.h"

namespace holdfast {

/// Where a clip is looked at from.
enum class ClipView {
  kFront,   ///< the whole clip's room, fixed, from the side (of four) that the first frame faces
  kSide,    ///< the same from the person's right
  kFollow,  ///< travels with the pelvis
  kHand,    ///< close to the holding hand
};

/// "front", "side", "follow" or "hand"; nothing for another name.
std::optional<ClipView> ParseClipView(std::string_view name);

/// What a sheet of pictures shows a clip from: kFollow where the person walks (the root leaves its
/// first place by more than a meter), else kFront.
ClipView SheetView(const Clip& clip);

struct ClipRenderOptions {
  RenderOptions picture;
  ClipView view = ClipView::kFront;
  std::optional<double> azimuth_rad, elevation_rad;  ///< in place of the view's own
  bool show_contact = true;
  /// (3 M x T) measured markers, drawn as small spheres: world, meters; NaN where one is not seen.
  Eigen::MatrixXd markers;
};

/// Pictures of a clip: the body, the object (and the table) where its track puts it, and on the
/// hands where they touch: amber within 3 mm outside the object's surface, red inside it. Const
/// after construction; frames may be drawn on any number of threads.
class ClipRenderer {
 public:
  /// `object` may be null; otherwise the clip must have an object track. `betas` are those of
  /// `body`. Throws Error for a track without the clip's length.
  /// `table` may be null too; it needs a table track.
  ClipRenderer(Clip clip, std::shared_ptr<const BodyModel> body, const Eigen::VectorXd& betas,
               const TriangleMesh* object, const TriangleMesh* table = nullptr);

  int NumFrames() const { return clip_.NumFrames(); }
  const Clip& GetClip() const { return clip_; }

  /// One frame, 0-based. Throws Error when there is no such frame.
  Image Draw(int frame, const ClipRenderOptions& options) const;

 private:
  Camera CameraFor(const BodyState& state, int frame, const ClipRenderOptions& options) const;
  Eigen::Matrix3Xd BodyColors(const BodyState& state, int frame, bool show_contact) const;
  bool Holds(int frame, Side side) const;

  Clip clip_;
  BodySurface surface_;
  std::optional<TriangleMesh> object_;
  std::optional<TriangleMesh> table_;
  std::optional<SignedDistance> object_distance_;
  Eigen::AlignedBox3d room_;  // what all frames of the clip fill
  double front_rad_ = 0.0;    // azimuth of the person's front
};

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
