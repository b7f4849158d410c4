// SPDX-License-Identifier: MIT
#include "geometry/score/own_body_score.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <mutex>
#include <utility>

#include "geometry/body/body_frames.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/parallel.h"
#include "geometry/score/clearance_memory.h"

namespace holdfast {
namespace {

// Skin farther than this from all queries is culled; no relevant skin is farther.
constexpr double kMargin_m = 0.3;

constexpr std::uint8_t kBothArms = kHoldsRight | kHoldsLeft;

// Tracks the deepest of the points so far, and where no deeper point is possible: depth is
// 1-Lipschitz.
class Deepest {
 public:
  explicit Deepest(const OwnBody::Posed& body) : body_(body) {}

  /// Whether a point within `radius` of `center` may be deeper than the deepest.
  bool Reaches(const Eigen::Vector3d& center, double radius) {
    if (last_depth_ + (center - last_).norm() + radius <= depth_) return false;
    const std::optional<OwnBody::Touch> touch = body_.Query(center);
    // No skin nearby, or at the rim of an excluded arm: nothing is known about neighboring points.
    if (!touch) return radius > 0.0;
    last_ = center;
    last_depth_ = touch->depth;
    if (radius == 0.0) depth_ = std::max(depth_, touch->depth);
    return touch->depth + radius > depth_;
  }
  void Add(const Eigen::Vector3d& point) { Reaches(point, 0.0); }
  double Depth_mm() const { return 1e3 * depth_; }

 private:
  const OwnBody::Posed& body_;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();  // a position and its depth
  double last_depth_ = std::numeric_limits<double>::infinity();
  double depth_ = 0.0;
};

OwnBody::Posed PosedNear(const OwnBody& body, const Eigen::Matrix3Xd& skin,
                         const Eigen::AlignedBox3d& box) {
  return {body, skin, box.min(), box.max(), kMargin_m};
}

double ObjectDepth_mm(const OwnBody& body, const Eigen::Matrix3Xd& skin, const BallTree& points,
                      const Eigen::Isometry3d& pose) {
  Eigen::AlignedBox3d box;
  for (const auto& point : points.Points().colwise()) box.extend(pose * point);
  const OwnBody::Posed posed = PosedNear(body, skin, box);
  Deepest deepest(posed);
  points.ForPoints([&](const Eigen::Vector3d& center, double radius,
                       std::size_t) { return deepest.Reaches(pose * center, radius); },
                   [&](int column) { deepest.Add(pose * points.Points().col(column)); });
  return deepest.Depth_mm();
}

double ArmsDepth_mm(const OwnBody& body, const Eigen::Matrix3Xd& skin,
                    const std::vector<int>& arms) {
  Eigen::AlignedBox3d box;
  for (const int v : arms) box.extend(skin.col(v));
  const OwnBody::Posed posed = PosedNear(body, skin, box);
  Deepest deepest(posed);
  for (const int v : arms) deepest.Add(skin.col(v));
  return deepest.Depth_mm();
}

// Depth of the deepest of `count` points, world.
template <typename Point>
double DepthInTable_mm(const SignedDistance& table, const Eigen::Isometry3d& world_from_table,
                       std::size_t count, const Point& point) {
  const Eigen::Isometry3d table_from_world = world_from_table.inverse();
  const Eigen::AlignedBox3d box(table.Min(), table.Max());
  double depth = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d at = table_from_world * point(i);
    if (box.contains(at)) depth = std::max(depth, -table.Distance(at));
  }
  return 1e3 * depth;
}

void Summarize(BodyDepth& depth) {
  if (depth.depth_mm.empty()) return;
  const auto worst = std::ranges::max_element(depth.depth_mm);
  depth.worst_frame = static_cast<int>(worst - depth.depth_mm.begin());
  depth.max_mm = *worst;
  for (const double mm : depth.depth_mm) depth.mean_mm += mm;
  depth.mean_mm /= static_cast<double>(depth.depth_mm.size());
}

// Sorts vertices such that spatial neighbors are adjacent.
std::vector<int> InOrder(const BodySurface& body, const std::vector<int>& vertices) {
  std::vector<int> ordered;
  BallTree(body.RestVertices()(Eigen::all, vertices))
      .ForPoints([](const Eigen::Vector3d&, double, std::size_t) { return true; },
                 [&](int column) { ordered.push_back(vertices[column]); });
  return ordered;
}

}  // namespace

double BodyDepth::DeepRatio(double deep_mm) const {
  const auto deep = std::ranges::count_if(depth_mm, [&](double mm) { return mm > deep_mm; });
  return depth_mm.empty() ? 0.0 : static_cast<double>(deep) / static_cast<double>(depth_mm.size());
}

OwnBodyMeter::OwnBodyMeter(const BodySurface& body, const TriangleMesh* object,
                           std::uint8_t holders)
    : body_(body), for_arms_(body, kBothArms), for_object_(body, holders) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const std::vector<int> arm = InOrder(body, OwnBody::ForearmAndHand(body, side));
    arms_.insert(arms_.end(), arm.begin(), arm.end());
  }
  if (object == nullptr) return;
  Eigen::Matrix3Xd all(3, object->NumVertices() + kOwnBodySamples);
  all << object->vertices, SampleSurface(*object, kOwnBodySamples);
  points_ = std::make_shared<const BallTree>(std::move(all));
}

OwnBodyScore OwnBodyMeter::Measure(const Clip& clip, int threads,
                                   const std::function<bool(int, int)>& progress) const {
  const int frames = clip.NumFrames();
  OwnBodyScore score;
  score.arms.depth_mm.resize(static_cast<std::size_t>(frames));
  const bool with_object = points_ != nullptr && clip.object;
  if (with_object) {
    score.object_points = static_cast<int>(points_->Points().cols());
    score.object.emplace().depth_mm.resize(static_cast<std::size_t>(frames));
  }
  std::optional<SignedDistance> table;
  if (const TriangleMesh* mesh = TableMesh(clip)) {
    table.emplace(*mesh);
    score.arms_in_table.emplace().depth_mm.resize(static_cast<std::size_t>(frames));
    if (with_object) {
      score.object_in_table.emplace().depth_mm.resize(static_cast<std::size_t>(frames));
    }
  }
  const int together = SharedFramesTogether(frames);
  const int blocks = (frames + together - 1) / together;
  std::atomic<bool> stopped{false};
  std::mutex mutex;
  int done = 0;
  ParallelFor(blocks, threads, [&](int block) {
    if (stopped) return;
    const int begin = block * together, count = std::min(together, frames - begin);
    std::vector<BodyState> states(static_cast<std::size_t>(count));
    ForwardFrames(body_, std::span(clip.pose).subspan(begin, count),
                  clip.trans.middleCols(begin, count), states);
    for (int k = 0; k < count; ++k) {
      const Eigen::Matrix3Xd& skin = states[k].vertices;
      score.arms.depth_mm[begin + k] = ArmsDepth_mm(for_arms_, skin, arms_);
      if (table) {
        score.arms_in_table->depth_mm[begin + k] =
            DepthInTable_mm(*table, clip.table->Pose(begin + k), arms_.size(),
                            [&](std::size_t i) { return skin.col(arms_[i]); });
      }
      if (!with_object) continue;
      if (table) {
        const Eigen::Isometry3d pose = clip.object->Pose(begin + k);
        const Eigen::Matrix3Xd& points = points_->Points();
        score.object_in_table->depth_mm[begin + k] = DepthInTable_mm(
            *table, clip.table->Pose(begin + k), static_cast<std::size_t>(points.cols()),
            [&](std::size_t i) { return pose * points.col(static_cast<Eigen::Index>(i)); });
      }
      score.object->depth_mm[begin + k] =
          ObjectDepth_mm(for_object_, skin, *points_, clip.object->Pose(begin + k));
    }
    const std::lock_guard lock(mutex);
    done += count;
    if (progress && !progress(done, frames)) stopped = true;
  });
  Summarize(score.arms);
  for (std::optional<BodyDepth>* depth :
       {&score.object, &score.object_in_table, &score.arms_in_table}) {
    if (*depth) Summarize(**depth);
  }
  return score;
}

std::optional<OwnBodyScore> MeasureOwnBody(const Clip& clip, const BodySurface& body,
                                           const TriangleMesh* object, std::uint8_t holders,
                                           int threads,
                                           const std::function<bool(int, int)>& progress) {
  if (body.Model().LoneHand()) return std::nullopt;
  return OwnBodyMeter(body, clip.object ? object : nullptr, holders)
      .Measure(clip, threads, progress);
}

}  // namespace holdfast
