// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/options.h"
#include "geometry/render/rasterizer.h"
#include "geometry/render/video.h"
#include "geometry/suggestion.h"

namespace holdfast {

/// Viewpoint of a clip.
enum class ClipView {
  kAuto,    ///< kFollow for a sheet of a walking person, otherwise kFront
  kFront,   ///< fixed view of the whole clip, from the one of four sides that the first frame faces
  kSide,    ///< same as kFront, from the person's right
  kFollow,  ///< follows the pelvis
  kHand,    ///< close-up of the holding hand from where hand and object are seen best
};

/// Default view of a picture sheet: kFollow if the person walks (the root moves more than a meter
/// from its first position), otherwise kFront.
ClipView SheetView(const Clip& clip);

struct ClipRenderOptions {
  RenderOptions picture;
  ClipView view = ClipView::kAuto;                   ///< of a single frame, kAuto is kFront
  std::optional<double> azimuth_deg, elevation_deg;  ///< override those of the view
  bool show_contact = true;
  /// (3 M x T) measured markers, drawn as small spheres: world, meters; NaN if not visible.
  Eigen::MatrixXd markers;
  /// Goals of the wrist (3 G x 1), or one that moves (3 x T), drawn as translucent spheres of 10
  /// cm, within which a goal counts as reached: world, meters.
  Eigen::MatrixXd goals;
  /// View kHand without `azimuth_deg` and `elevation_deg`: azimuth from the person's heading, and
  /// elevation; default: ClipRenderer::HandDirection of the frame.
  std::optional<Eigen::Vector2d> hand_direction_rad;
};

/// Renders a clip: the body, and the object (and the table) at their tracked poses. Contact is
/// colored on the hands: amber within 3 mm outside the object's surface, red inside. Const after
/// construction; frames may be drawn on any number of threads.
class ClipRenderer {
 public:
  /// `object` may be null; otherwise the clip must have an object track. `betas` are those of
  /// `body`. Throws Error for a track whose length differs from the clip's.
  ClipRenderer(Clip clip, std::shared_ptr<const BodyModel> body, const Eigen::VectorXd& betas,
               const TriangleMesh* object);

  int NumFrames() const { return clip_.NumFrames(); }
  const Clip& GetClip() const { return clip_; }

  /// Draws one frame, 0-based. Throws Error if there is no such frame.
  Image Draw(int frame, const ClipRenderOptions& options) const;

  /// Direction from which view kHand sees most of hand and object over these frames (at most 12 of
  /// them are looked at): azimuth from the person's heading, and elevation.
  Eigen::Vector2d HandDirection(std::span<const int> frames, int threads = 1) const;

 private:
  // What the close-up of the hand shows: the knuckles of the hand that holds the object, that will
  // hold it or has held it, or of both hands.
  struct CloseUp {
    Eigen::Vector3d point;
    double radius_m;
    std::uint8_t hands;  // bits of holding_hand
  };
  CloseUp CloseUpOf(const BodyState& state, int frame) const;
  double Heading(int frame) const;
  Camera CameraFor(const BodyState& state, int frame, const ClipRenderOptions& options) const;
  Eigen::Matrix3Xd BodyColors(const BodyState& state, int frame, bool show_contact) const;

  Clip clip_;
  BodySurface surface_;
  std::optional<TriangleMesh> object_;
  std::optional<TriangleMesh> table_;
  std::optional<SignedDistance> object_distance_;
  Eigen::AlignedBox3d room_;  // bounding box of all frames of the clip
  double front_rad_ = 0.0;    // azimuth of the person's front
};

/// Output of a clip's pictures, by file name: a video (.gif, .mp4), numbered pictures (a .png with
/// %d or %03d in the name), or otherwise one picture or a sheet of pictures (.png). Without a path:
/// the frames of numbered pictures, for DrawPictures.
struct PictureFile {
  std::filesystem::path path;
  std::optional<VideoFormat> video;
  std::optional<NumberedName> numbered;
};

/// Throws Error for a name of neither a picture nor a video, and for a numbered video.
PictureFile PictureFileOf(const std::filesystem::path& path);

struct ClipPictureOptions {
  ClipRenderOptions how;
  std::pair<int, int> size{640, 480};  ///< of each picture, pixels: replaces that of `how`
  std::optional<int> frame;            ///< only this frame, 0-based
  int every = 1;                       ///< numbered pictures and videos: every n-th frame
  std::optional<double> fps;           ///< of a video; default: the clip's, divided by `every`
  std::pair<int, int> sheet{4, 2};     ///< columns, rows; frames are evenly spaced in the clip
  int threads = 1;
};
OptionTable OptionsOf(ClipPictureOptions& options);

/// Frames to draw, and how. Adjusted to the video format: even sizes, or a rate of at most
/// kMaxGifRate.
struct ClipPictures {
  PictureFile file;
  ClipRenderOptions how;
  std::vector<int> frames;
  double frame_rate = 0.0;  ///< of a video, Hz
  int columns = 1, threads = 1;
  std::string note;  ///< about an adjusted rate; empty: none
};
/// Throws Error for a frame that the clip does not have, and for a frame rate with `every`.
ClipPictures PlanPictures(const Clip& clip, const PictureFile& file,
                          const ClipPictureOptions& options);

/// Draws the frames on several threads. Empty if `progress(done, total)`, as below, stopped it.
std::vector<Image> DrawPictures(const ClipRenderer& renderer, const ClipPictures& pictures,
                                const std::function<bool(int, int)>& progress = {});

/// Draws the frames on several threads and writes them; videos and numbered pictures in batches.
/// `progress(done, total)` is called after each picture, never concurrently (a .gif draws some
/// frames twice, and counts them twice), and stops by returning false. Then WritePictures returns
/// false: no video or sheet is written, only the numbered pictures so far. Throws Error as
/// ClipRenderer and WriteVideo do.
bool WritePictures(const ClipRenderer& renderer, const ClipPictures& pictures,
                   const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
