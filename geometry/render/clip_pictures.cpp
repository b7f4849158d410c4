// SPDX-License-Identifier: MIT
#include "geometry/render/clip_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numbers>
#include <numeric>
#include <span>
#include <string>
#include <tuple>

#include <fmt/format.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/resample.h"
#include "geometry/error.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/mesh/spheres.h"
#include "geometry/parallel.h"
#include "geometry/render/image.h"
#include "geometry/render/visibility.h"
#include "geometry/rotation.h"

namespace holdfast {

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

OptionTable OptionsOf(ClipPictureOptions& options) {
  OptionTable table;
  table.Choice("camera", options.how.view,
               {{"auto", ClipView::kAuto},
                {"front", ClipView::kFront},
                {"side", ClipView::kSide},
                {"follow", ClipView::kFollow},
                {"hand", ClipView::kHand}},
               "View: front, side, follow (follows the pelvis), hand (close-up of the holding "
               "hand), or auto (follow for a sheet of a walking person, otherwise front)");
  table.Number("azimuth", "deg", options.how.azimuth_deg, {-360, 360}, "depends on --camera",
               "Azimuth of the camera: degrees from the front (follow, hand: from -y), positive to "
               "the person's left");
  table.Number("elevation", "deg", options.how.elevation_deg, {-90, 90}, "depends on --camera",
               "Elevation of the camera, degrees");
  table.Pair("sheet", options.sheet, {1, 100}, "Columns and rows of the sheet");
  table.Number("frame", "", options.frame, kNonNegative, "all",
               "Draw only this frame, counted from 0");
  table.Number("every", "", options.every, {1, 1e6},
               "Use every n-th frame (numbered pictures and videos)");
  table.Number("fps", "", options.fps, {0.1, 240.0}, "the clip's; .gif: at most 50",
               "Frame rate of a video; does not change the playback speed");
  table.Pair("size", options.size, {1, 16384}, "Width and height of each picture, pixels");
  table.Number("supersampling", "", options.how.picture.supersampling, {1, 4},
               "Samples along each side of a pixel");
  table.Flag("contact", options.how.show_contact,
             "Color the skin at contacts (amber: within 3 mm of the object; red: inside it)");
  return table;
}

ClipPictures PlanPictures(const Clip& clip, const PictureFile& file,
                          const ClipPictureOptions& options) {
  const int frames = clip.NumFrames();
  if (options.frame && (*options.frame < 0 || *options.frame >= frames)) {
    throw Error("frame", fmt::format("{} of a clip of {} frames", *options.frame, frames),
                fmt::format("Give 0 to {}", frames - 1));
  }
  if (options.fps && options.every != 1) {
    throw Error("fps", "excludes 'every'", "Give one of them");
  }
  ClipPictures out;
  out.file = file;
  out.how = options.how;
  std::tie(out.how.picture.width, out.how.picture.height) = options.size;
  const bool all = file.numbered || file.path.empty();
  const bool sheet = !options.frame && !file.video && !all;
  if (out.how.view == ClipView::kAuto) out.how.view = sheet ? SheetView(clip) : ClipView::kFront;
  out.columns = options.sheet.first;
  out.threads = options.threads;
  if (options.frame) {
    out.frames = {*options.frame};
    out.frame_rate = 1.0;
  } else if (file.video) {
    out.frame_rate = options.fps.value_or(clip.frame_rate / options.every);
    if (file.video == VideoFormat::kGif && out.frame_rate > kMaxGifRate) {
      out.note =
          fmt::format("a .gif shows at most {0:g} frames per second: using {0:g} instead of {1:g}",
                      kMaxGifRate, out.frame_rate);
      out.frame_rate = kMaxGifRate;
    }
    out.frames = FramesAtRate(frames, clip.frame_rate, out.frame_rate);
  } else if (all) {
    out.frames = EveryFrame(frames, options.every);
  } else {
    out.frames = EvenFrames(frames, options.sheet.first * options.sheet.second);
  }
  if (file.video == VideoFormat::kMp4) {  // chroma is stored per two by two pixels
    out.how.picture.width += out.how.picture.width % 2;
    out.how.picture.height += out.how.picture.height % 2;
  }
  return out;
}

namespace {

// Draws frames on several threads, until `progress` stops it.
class Drawing {
 public:
  Drawing(const ClipRenderer& renderer, const ClipPictures& pictures,
          const std::function<bool(int, int)>& progress)
      : renderer_(renderer), pictures_(pictures), progress_(progress), how_(pictures.how) {
    total_ = static_cast<int>(pictures.frames.size());
    if (pictures.file.video) total_ = FramesRequested(*pictures.file.video, total_);
    if (how_.view == ClipView::kHand && !how_.azimuth_deg && !how_.elevation_deg) {
      how_.hand_direction_rad = renderer.HandDirection(pictures.frames, pictures.threads);
    }
  }

  // `drawn` are indices into the list of frames; returns an empty vector once stopped.
  std::vector<Image> operator()(std::span<const int> drawn) {
    std::vector<Image> images(drawn.size());
    ParallelFor(static_cast<int>(drawn.size()), pictures_.threads, [&](int k) {
      if (std::scoped_lock guard(mutex_); stopped_) return;
      images[k] = renderer_.Draw(pictures_.frames[drawn[k]], how_);
      const std::scoped_lock guard(mutex_);
      if (stopped_) return;
      ++done_;
      if (progress_ && !progress_(done_, total_)) stopped_ = true;
    });
    if (stopped_) images.clear();
    return images;
  }
  bool Stopped() const { return stopped_; }

 private:
  const ClipRenderer& renderer_;
  const ClipPictures& pictures_;
  const std::function<bool(int, int)>& progress_;
  ClipRenderOptions how_;
  std::mutex mutex_;
  int total_, done_ = 0;
  bool stopped_ = false;
};

std::vector<int> PlacesOf(const ClipPictures& pictures) {
  std::vector<int> places(pictures.frames.size());
  std::iota(places.begin(), places.end(), 0);
  return places;
}

}  // namespace

std::vector<Image> DrawPictures(const ClipRenderer& renderer, const ClipPictures& pictures,
                                const std::function<bool(int, int)>& progress) {
  return Drawing(renderer, pictures, progress)(PlacesOf(pictures));
}

bool WritePictures(const ClipRenderer& renderer, const ClipPictures& pictures,
                   const std::function<bool(int, int)>& progress) {
  Drawing drawing(renderer, pictures, progress);
  const auto draw = [&](std::span<const int> drawn) { return drawing(drawn); };
  const int batch = 2 * pictures.threads;  // limits memory, and keeps the threads busy
  const std::vector<int> places = PlacesOf(pictures);
  const PictureFile& file = pictures.file;
  if (file.video) {
    WriteVideo(file.path, static_cast<int>(places.size()), pictures.frame_rate, batch, draw);
  } else if (file.numbered) {
    for (std::size_t k = 0; k < places.size() && !drawing.Stopped();
         k += static_cast<std::size_t>(batch)) {
      const std::size_t count = std::min<std::size_t>(batch, places.size() - k);
      const std::vector<Image> images = draw({places.data() + k, count});
      for (std::size_t i = 0; i < images.size(); ++i) {
        WritePng(images[i], file.numbered->Name(pictures.frames[k + i]));
      }
    }
  } else if (const std::vector<Image> tiles = draw(places); !tiles.empty()) {
    std::vector<std::string> labels;
    for (const int t : pictures.frames) {
      labels.push_back(fmt::format("{:.2f} s", t / renderer.GetClip().frame_rate));
    }
    WritePng(tiles.size() == 1 ? tiles[0] : ContactSheet(tiles, labels, pictures.columns),
             file.path);
  }
  return !drawing.Stopped();
}

namespace {

const Eigen::Vector3d kSkin(0.80, 0.69, 0.62);
const Eigen::Vector3d kObject(0.36, 0.52, 0.68);
const Eigen::Vector3d kTable(0.62, 0.56, 0.48);
const Eigen::Vector3d kTouching(0.98, 0.70, 0.15);
const Eigen::Vector3d kInside(0.86, 0.08, 0.10);
const Eigen::Vector3d kMarker(0.10, 0.55, 0.30);
const Eigen::Vector3d kGoal(0.82, 0.29, 0.36);
constexpr double kContactDistance = 0.003;  // meters
constexpr double kFullDepth = 0.002;        // penetration depth of full red

constexpr double kWalk = 1.0;  // meters
constexpr double kMarkerRadius = 0.008;
constexpr double kGoalRadius = 0.10;  // the wrist within it has reached the goal

// The hand view.
constexpr double kHandRadius = 0.17;  // radius around the fingers, meters
constexpr double kMaxApart = 0.5;     // of two hands that are seen together, meters
constexpr double kHeading_s = 0.5;    // the heading is averaged over this long before and after
constexpr int kAzimuths = 12;
constexpr int kLookedAt = 12;        // frames
constexpr int kLookPixels = 40;      // width and height of a trial picture
constexpr double kFrontWorth = 0.3;  // of the front over the back, in ln of the visible area

// Returns a mesh at its tracked pose in a frame.
TriangleMesh Placed(const TriangleMesh& mesh, const ObjectTrack& track, int frame) {
  TriangleMesh placed = mesh;
  placed.vertices = track.Pose(frame) * mesh.vertices;
  return placed;
}

void RequireTrack(const Clip& clip, const std::optional<ObjectTrack>& track, const char* what) {
  if (track && track->trans.cols() == clip.NumFrames() &&
      track->orient.cols() == clip.NumFrames()) {
    return;
  }
  throw Error("clip",
              fmt::format("{} cannot be drawn: its track is missing or has another length", what),
              "Fit the object first (holdfast fit), or draw the body alone");
}

// Azimuth of a person's front, rounded to quarter turns, so that somebody facing roughly -y is seen
// from there. Zero for a lying person.
double FrontOf(const JointPose& pose) {
  const Eigen::Vector3d forward = ExpSO3(Eigen::Vector3d(pose.col(0))).col(2);
  if (forward.head<2>().norm() < 0.5) return 0.0;
  const double quarter = 0.5 * std::numbers::pi;
  return quarter * std::round(std::atan2(forward.x(), -forward.y()) / quarter);
}

}  // namespace

ClipView SheetView(const Clip& clip) {
  const Eigen::Matrix2Xd ground = clip.trans.topRows<2>();
  const bool walks = (ground.colwise() - ground.col(0)).colwise().norm().maxCoeff() > kWalk;
  return walks ? ClipView::kFollow : ClipView::kFront;
}

ClipRenderer::ClipRenderer(Clip clip, std::shared_ptr<const BodyModel> body,
                           const Eigen::VectorXd& betas, const TriangleMesh* object)
    : clip_(std::move(clip)), surface_(std::move(body), betas) {
  if (clip_.NumFrames() > 0 && !surface_.Model().LoneHand()) front_rad_ = FrontOf(clip_.pose[0]);
  if (object != nullptr) {
    RequireTrack(clip_, clip_.object, "an object");
    object_ = *object;
    object_distance_.emplace(*object);
  }
  if (const TriangleMesh* table = TableMesh(clip_)) {
    RequireTrack(clip_, clip_.table, "a table");
    table_ = SplitAtCreases(*table).mesh;  // tables have sharp edges
    const TriangleMesh first = Placed(*table_, *clip_.table, 0);
    for (const auto p : first.vertices.colwise()) room_.extend(Eigen::Vector3d(p));
  }
  // Joints lie inside the body: add a margin for the skin, and for the top of the head.
  BodyState state;
  for (int t = 0; t < clip_.NumFrames(); ++t) {
    ForwardJoints(surface_.RestJoints(), clip_.pose[t], clip_.trans.col(t), state);
    for (int j = 0; j < kNumJoints; ++j) {
      const Eigen::Vector3d p = state.joints.col(j);
      room_.extend(p - Eigen::Vector3d(0.08, 0.08, 0.03));
      room_.extend(p + Eigen::Vector3d(0.08, 0.08, j == 23 || j == 24 ? 0.16 : 0.03));
    }
    if (!object_) continue;
    const Eigen::Vector3d center = object_->vertices.rowwise().mean();
    room_.extend(ExpSO3(clip_.object->orient.col(t)) * center + clip_.object->trans.col(t));
  }
}

ClipRenderer::CloseUp ClipRenderer::CloseUpOf(const BodyState& state, int frame) const {
  CloseUp close{{}, kHandRadius, kHoldsRight};
  const std::vector<std::uint8_t>& holding = clip_.holding_hand;
  const auto holds = [](std::uint8_t bits) { return bits != 0; };
  if (const std::optional<Side> lone = surface_.Model().LoneHand()) {
    close.hands = HoldingBit(*lone);
  } else if (const auto next = std::find_if(holding.begin() + (holding.empty() ? 0 : frame),
                                            holding.end(), holds);
             next != holding.end()) {
    close.hands = *next;
  } else if (const auto last = std::find_if(holding.rbegin(), holding.rend(), holds);
             last != holding.rend()) {
    close.hands = *last;
  }
  const Eigen::Vector3d right = state.joints.col(HandBegin(Side::kRight) + 4);
  const Eigen::Vector3d left = state.joints.col(HandBegin(Side::kLeft) + 4);
  const double apart = (right - left).norm();
  if (close.hands == (kHoldsRight | kHoldsLeft) && apart < kMaxApart) {
    close.point = 0.5 * (right + left);
    close.radius_m += 0.5 * apart;
  } else {
    close.point = (close.hands & kHoldsRight) != 0 ? right : left;
  }
  return close;
}

double ClipRenderer::Heading(int frame) const {
  if (surface_.Model().LoneHand()) return 0.0;
  const int around = static_cast<int>(std::lround(kHeading_s * clip_.frame_rate));
  Eigen::Vector2d forward = Eigen::Vector2d::Zero();
  for (int t = std::max(0, frame - around); t < std::min(NumFrames(), frame + around + 1); ++t) {
    forward += ExpSO3(Eigen::Vector3d(clip_.pose[t].col(0))).col(2).head<2>();
  }
  return std::atan2(forward.x(), -forward.y());
}

Eigen::Vector2d ClipRenderer::HandDirection(std::span<const int> frames, int threads) const {
  std::vector<Eigen::Vector2d> directions;
  for (const double elevation : {0.35, 0.0, 0.8, -0.35}) {
    for (int k = 0; k < kAzimuths; ++k) {
      const double turn = 2.0 * std::numbers::pi * k / kAzimuths;
      directions.emplace_back(0.35 + (k <= kAzimuths / 2 ? turn : turn - 2.0 * std::numbers::pi),
                              elevation);
    }
  }
  const auto looked = static_cast<int>(std::min<std::size_t>(frames.size(), kLookedAt));
  Eigen::MatrixXd seen(directions.size(), looked);
  ParallelFor(looked, threads, [&](int k) {
    const int frame = frames[frames.size() * (2 * static_cast<std::size_t>(k) + 1) /
                             (2 * static_cast<std::size_t>(looked))];
    BodyState state;
    Forward(surface_, clip_.pose[frame], clip_.trans.col(frame), state);
    const CloseUp close = CloseUpOf(state, frame);
    // 1: may hide them, 2: hand, 3: object.
    std::vector<std::pair<TriangleMesh, std::vector<std::uint32_t>>> meshes;
    const TriangleMesh body{state.vertices, surface_.Faces()};
    std::vector<std::uint32_t> of_vertex(static_cast<std::size_t>(body.NumVertices()), 1);
    for (const Side side : {Side::kRight, Side::kLeft}) {
      if ((close.hands & HoldingBit(side)) == 0) continue;
      for (const int v : surface_.Model().HandVertexIds(side)) of_vertex[v] = 2;
    }
    meshes.emplace_back(body, std::move(of_vertex));
    const auto add = [&](const TriangleMesh& mesh, std::uint32_t id) {
      meshes.emplace_back(mesh, std::vector<std::uint32_t>(mesh.NumVertices(), id));
    };
    if (object_) add(Placed(*object_, *clip_.object, frame), 3);
    if (table_) add(Placed(*table_, *clip_.table, frame), 1);
    for (std::size_t d = 0; d < directions.size(); ++d) {
      const View view(CloseUpCamera(close.point, close.radius_m, Heading(frame) + directions[d].x(),
                                    directions[d].y()),
                      kLookPixels, kLookPixels);
      VisibilityBuffer buffer(view);
      for (const auto& [mesh, ids] : meshes) {
        for (const auto corner : mesh.faces.colwise()) {
          buffer.Draw(view.ToCamera(mesh.vertices.col(corner[0])),
                      view.ToCamera(mesh.vertices.col(corner[1])),
                      view.ToCamera(mesh.vertices.col(corner[2])), ids[corner[0]]);
        }
      }
      int hand = 1, object = 1;
      for (int y = 0; y < kLookPixels; ++y) {
        for (int x = 0; x < kLookPixels; ++x) {
          hand += buffer.Id(x, y) == 2;
          object += buffer.Id(x, y) == 3;
        }
      }
      seen(d, k) = std::log(hand) + (object_ ? std::log(object) : 0.0);
    }
  });
  Eigen::VectorXd worth = seen.rowwise().mean();
  for (std::size_t d = 0; d < directions.size(); ++d) {
    worth(d) += kFrontWorth * std::cos(directions[d].x()) * std::cos(directions[d].y());
  }
  Eigen::Index best = 0;
  worth.maxCoeff(&best);
  return directions[best];
}

Camera ClipRenderer::CameraFor(const BodyState& state, int frame,
                               const ClipRenderOptions& options) const {
  const double aspect =
      static_cast<double>(options.picture.width) / std::max(1, options.picture.height);
  const auto azimuth = [&](double usual) {
    return options.azimuth_deg ? *options.azimuth_deg * kDegree : usual;
  };
  const auto from_front = [&](double usual) { return front_rad_ + azimuth(usual); };
  const auto elevation = [&](double usual) {
    return options.elevation_deg ? *options.elevation_deg * kDegree : usual;
  };
  switch (options.view) {
    case ClipView::kAuto:
    case ClipView::kFront:
      return FitCamera(room_, from_front(-0.3), elevation(0.12), aspect);
    case ClipView::kSide:
      return FitCamera(room_, from_front(-0.5 * std::numbers::pi), elevation(0.1), aspect);
    case ClipView::kFollow:
      if (surface_.Model().LoneHand()) {  // at a body's distance a hand would be tiny
        return CloseUpCamera(state.joints.col(0), 1.6 * kHandRadius / std::min(1.0, aspect),
                             azimuth(-0.7), elevation(0.2));
      }
      return OrbitCamera(state.joints.col(0) + Eigen::Vector3d(0.0, 0.0, 0.02), azimuth(-0.7),
                         elevation(0.2), 3.4 / std::min(1.0, aspect));
    case ClipView::kHand:
      break;
  }
  const CloseUp close = CloseUpOf(state, frame);
  const double radius = close.radius_m / std::min(1.0, aspect);
  if (options.azimuth_deg || options.elevation_deg) {
    return CloseUpCamera(close.point, radius, azimuth(0.35), elevation(0.35));
  }
  const Eigen::Vector2d direction =
      options.hand_direction_rad ? *options.hand_direction_rad : HandDirection({{frame}});
  return CloseUpCamera(close.point, radius, Heading(frame) + direction.x(), direction.y());
}

Eigen::Matrix3Xd ClipRenderer::BodyColors(const BodyState& state, int frame,
                                          bool show_contact) const {
  Eigen::Matrix3Xd colors = kSkin.replicate(1, surface_.NumVertices());
  if (!object_ || !show_contact) return colors;
  const Eigen::Matrix3d world_from_object = ExpSO3(clip_.object->orient.col(frame));
  for (const Side side : {Side::kRight, Side::kLeft}) {
    for (const int v : surface_.Model().HandVertexIds(side)) {
      const Eigen::Vector3d in_object =
          world_from_object.transpose() * (state.vertices.col(v) - clip_.object->trans.col(frame));
      const double distance = object_distance_->Distance(in_object);
      if (distance >= kContactDistance) continue;
      if (distance >= 0.0) {
        const double share = 1.0 - 0.6 * distance / kContactDistance;
        colors.col(v) = kSkin + share * (kTouching - kSkin);
      } else {
        const double share = 0.4 + 0.6 * std::min(1.0, -distance / kFullDepth);
        colors.col(v) = kTouching + share * (kInside - kTouching);
      }
    }
  }
  return colors;
}

Image ClipRenderer::Draw(int frame, const ClipRenderOptions& options) const {
  if (frame < 0 || frame >= NumFrames()) {
    throw Error("render", fmt::format("no frame {}", frame),
                fmt::format("The clip has frames 0 to {}", NumFrames() - 1));
  }
  if (options.markers.size() > 0 && options.markers.cols() != NumFrames()) {
    throw Error("render",
                fmt::format("the markers have {} frames, the clip has {}", options.markers.cols(),
                            NumFrames()),
                "Give the markers that the clip was solved from");
  }
  RenderOptions picture = options.picture;
  // A hand in a camera's frame stands on nothing.
  if (surface_.Model().LoneHand() && room_.min().z() < picture.ground_height_m)
    picture.ground = false;
  BodyState state;
  Forward(surface_, clip_.pose[frame], clip_.trans.col(frame), state);
  const TriangleMesh body{state.vertices, surface_.Faces()};
  const Eigen::Matrix3Xd colors = BodyColors(state, frame, options.show_contact);
  std::vector<RenderItem> items = {{&body, kSkin, &colors}};
  TriangleMesh object, table, markers, goals;
  if (options.markers.size() > 0) {
    markers = Spheres(options.markers.col(frame).reshaped(3, options.markers.rows() / 3),
                      kMarkerRadius, 4);
    items.push_back({&markers, kMarker});
  }
  if (object_) {
    object = Placed(*object_, *clip_.object, frame);
    items.push_back({&object, kObject});
  }
  if (table_) {
    table = Placed(*table_, *clip_.table, frame);
    items.push_back({&table, kTable});
  }
  if (options.goals.size() > 0) {
    const auto now = options.goals.col(std::min<Eigen::Index>(frame, options.goals.cols() - 1));
    goals = Spheres(now.reshaped(3, now.size() / 3), kGoalRadius, 12);
    items.push_back({&goals, kGoal, nullptr, true});
  }
  return Render(items, CameraFor(state, frame, options), picture);
}

}  // namespace holdfast
