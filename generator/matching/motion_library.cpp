// SPDX-License-Identifier: MIT
#include "generator/matching/motion_library.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/error.h"

namespace holdfast {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kShortestClip = 15;  // frames
constexpr int kMinRemaining = 10;
constexpr std::array<int, 3> kAhead = {10, 20, 30};  // frames
// Limits for standing or walking frames: pelvis height as a fraction of the standing height, lean,
// and speed.
constexpr double kLowestPelvis = 0.85, kHighestPelvis = 1.08;
constexpr double kMaxLean = 0.6;  // radians, of the spine
constexpr double kFastest = 1.9;  // m/s

// Groups of features with a common scale: first column, number of columns, weight.
struct Group {
  int begin, size;
  float weight;
};
constexpr std::array<Group, 9> kGroups = {{{0, 6, 1.0f},
                                           {6, 6, 1.0f},
                                           {12, 3, 1.2f},
                                           {15, 1, 0.6f},
                                           {16, 6, 0.45f},
                                           {22, 3, 0.4f},
                                           {25, 1, 0.6f},
                                           {26, 6, 1.5f},
                                           {32, 6, 1.6f}}};

}  // namespace

MotionLibrary::MotionLibrary(const Eigen::Matrix3Xd& rest_joints, double floor_y)
    : rest_joints_(rest_joints),
      soles_(rest_joints, floor_y),
      standing_pelvis_(rest_joints(1, 0) - floor_y) {}

void MotionLibrary::Add(const Clip& clip, const std::string& name, const ClipUse& use) {
  if (clip.NumFrames() < kShortestClip) return;
  LibraryClip straight;
  straight.name = name;
  straight.frames = BodyFrames(clip, rest_joints_);
  straight.reach = use.reach;
  LibraryClip mirrored;
  mirrored.name = name;
  mirrored.mirrored = true;
  for (const BodyFrame& frame : straight.frames) mirrored.frames.push_back(Mirror(frame));
  mirrored.reach = use.reach;
  if (use.reach) mirrored.reach->wrist = OtherSide(use.reach->wrist);
  AddOne(std::move(straight), use.walking);
  AddOne(std::move(mirrored), use.walking);
}

void MotionLibrary::AddOne(LibraryClip clip, bool walking) {
  const int count = static_cast<int>(clip.frames.size());
  const std::vector<BodyPlacement> placed = holdfast::Place(rest_joints_, clip.frames);
  clip.contacts = FindContacts(soles_.At(placed), kFrameRate);
  clip.first_row = static_cast<int>(rows_.size());
  for (int t = 0; t < count; ++t) {
    rows_.push_back(Feature(clip, placed, t));
    const BodyFrame& frame = clip.frames[t];
    const int from = std::max(0, t - 6), to = std::min(count - 1, t + 6);
    const double speed = (clip.frames[to].pelvis - clip.frames[from].pelvis).head<2>().norm() *
                         kFrameRate / (to - from);
    const double height = frame.pelvis.z() / standing_pelvis_;
    const double lean = std::acos(std::clamp(
        (placed[t].joints.col(12) - placed[t].joints.col(0)).normalized().z(), -1.0, 1.0));
    bool grounded = false;
    for (int s = from; s <= to; ++s) grounded = grounded || clip.contacts[s] != 0;
    is_walking_.push_back(walking && grounded && height > kLowestPelvis &&
                          height < kHighestPelvis && lean < kMaxLean && speed < kFastest &&
                          t + kMinRemaining < count && t > 0);
  }
  clips_.push_back(std::move(clip));
}

MatchRow MotionLibrary::Feature(const LibraryClip& clip, const std::vector<BodyPlacement>& placed,
                                int frame) const {
  const int last = static_cast<int>(clip.frames.size()) - 1;
  const int before = std::max(0, frame - 1), after = std::min(last, frame + 1);
  const double rate = kFrameRate / (after - before);
  const double yaw = Yaw(clip.frames[frame]);
  const Eigen::Matrix3d heading_from_world =
      Eigen::AngleAxisd(-yaw, Vector3d::UnitZ()).toRotationMatrix();
  const Vector3d pelvis = clip.frames[frame].pelvis;
  const Vector3d ground(pelvis.x(), pelvis.y(), 0.0);
  const auto position = [&](int joint) -> Vector3d {
    return heading_from_world * (placed[frame].joints.col(joint) - ground);
  };
  const auto velocity = [&](int joint) -> Vector3d {
    return rate * heading_from_world *
           (placed[after].joints.col(joint) - placed[before].joints.col(joint));
  };
  Eigen::Matrix<double, MatchRow::RowsAtCompileTime, 1> f;
  f << position(10), position(11), velocity(10), velocity(11), velocity(0), pelvis.z(),
      position(20), position(21), (position(12) - position(0)).normalized(),
      rate * std::remainder(Yaw(clip.frames[after]) - Yaw(clip.frames[before]), 2.0 * M_PI),
      Eigen::Matrix<double, kMatchPath, 1>::Zero();
  // Beyond its end, a clip is extrapolated at its final velocity.
  const int tail = std::max(0, last - 6);
  const Vector2d leaving =
      (clip.frames[last].pelvis - clip.frames[tail].pelvis).head<2>() / std::max(1, last - tail);
  for (std::size_t k = 0; k < kAhead.size(); ++k) {
    const int ahead = frame + kAhead[k];
    const BodyFrame& future = clip.frames[std::min(ahead, last)];
    const Vector2d at = future.pelvis.head<2>() + std::max(0, ahead - last) * leaving;
    const int row = kMatchPose + 2 * static_cast<int>(k);
    const Vector2d in_heading = Eigen::Rotation2Dd(-yaw) * Vector2d(at - pelvis.head<2>());
    f.segment<2>(row) = in_heading;
    const double turn = Yaw(future) - yaw;
    f.segment<2>(row + 6) << std::sin(turn), -std::cos(turn);
  }
  return f.cast<float>();
}

void MotionLibrary::Finish() {
  std::vector<int> found;
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    if (is_walking_[row] != 0) found.push_back(static_cast<int>(row));
  }
  if (found.empty()) {
    throw Error("motion library", "no clip shows a person who stands or walks",
                "Give motion on level ground, heights in meters");
  }
  MatchRow mean = MatchRow::Zero(), square = MatchRow::Zero();
  for (const int row : found) {
    mean += rows_[row];
    square += rows_[row].cwiseAbs2();
  }
  mean /= static_cast<float>(found.size());
  square /= static_cast<float>(found.size());
  const MatchRow variance = (square - mean.cwiseAbs2()).cwiseMax(0.0f);
  for (const Group& group : kGroups) {
    const float deviation = std::sqrt(variance.segment(group.begin, group.size).mean()) + 1e-4f;
    scale_.segment(group.begin, group.size)
        .setConstant(group.weight / deviation / std::sqrt(static_cast<float>(group.size)));
  }
  for (MatchRow& row : rows_) row = row.cwiseProduct(scale_);
  search_rows_.resize(Eigen::NoChange, static_cast<Eigen::Index>(found.size()));
  int clip = 0;
  for (std::size_t k = 0; k < found.size(); ++k) {
    while (clip + 1 < static_cast<int>(clips_.size()) && clips_[clip + 1].first_row <= found[k]) {
      ++clip;
    }
    search_places_.push_back({clip, found[k] - clips_[clip].first_row, 0.0f});
    search_rows_.col(static_cast<Eigen::Index>(k)) = rows_[found[k]];
  }
}

MatchRow MotionLibrary::Query(const Place& at, const FuturePath& path) const {
  MatchRow query = rows_[clips_[at.clip].first_row + at.frame];
  query.tail<kMatchPath>() = path.reshaped().cast<float>().cwiseProduct(scale_.tail<kMatchPath>());
  return query;
}

MotionLibrary::Place MotionLibrary::Search(const MatchRow& query) const {
  // Linear search is faster than an exact k-d tree in 38 dimensions (33,000 rows: 0.24, 0.35 ms).
  float least = std::numeric_limits<float>::infinity();
  Eigen::Index best = 0;
  for (Eigen::Index k = 0; k < search_rows_.cols(); ++k) {
    const float cost = (search_rows_.col(k) - query).squaredNorm();
    if (cost < least) {
      least = cost;
      best = k;
    }
  }
  Place place = search_places_[static_cast<std::size_t>(best)];
  place.cost = least;
  return place;
}

float MotionLibrary::Cost(const MatchRow& query, const Place& at) const {
  return (rows_[clips_[at.clip].first_row + at.frame] - query).squaredNorm();
}

float MotionLibrary::PoseCost(const Place& a, const Place& b) const {
  const MatchRow difference =
      rows_[clips_[a.clip].first_row + a.frame] - rows_[clips_[b.clip].first_row + b.frame];
  return difference.head<kMatchPose>().squaredNorm();
}

double MotionLibrary::FootDistance(const Place& a, const Place& b) const {
  const MatchRow difference =
      (rows_[clips_[a.clip].first_row + a.frame] - rows_[clips_[b.clip].first_row + b.frame])
          .cwiseQuotient(scale_);
  return std::max(difference.head<2>().norm(), difference.segment<2>(3).norm());
}

}  // namespace holdfast
