// SPDX-License-Identifier: MIT
#include "geometry/score/object_rest.h"

#include <algorithm>
#include <optional>

#include "geometry/clip/clip_arrays.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kStill_m_s = 0.02, kSkin_m = 0.01, kSupport_m = 0.02;

// Speed of the object's center, the lower of those before and after the frame.
double Speed(const Clip& clip, const Vector3d& center, int t) {
  double speed = 1e9;
  for (const int other : {t - 1, t + 1}) {
    if (other < 0 || other >= clip.NumFrames()) continue;
    const Vector3d way = clip.object->Pose(other) * center - clip.object->Pose(t) * center;
    speed = std::min(speed, clip.frame_rate * way.norm());
  }
  return clip.NumFrames() == 1 ? 0.0 : speed;
}

bool TouchesSkin(const BodyState& state, const Isometry3d& world_from_object,
                 const Eigen::AlignedBox3d& box, const SignedDistance& distance) {
  const Isometry3d object_from_world = world_from_object.inverse();
  for (const auto& vertex : state.vertices.colwise()) {
    const Vector3d at = object_from_world * Vector3d(vertex);
    if (box.contains(at) && distance.Distance(at) < kSkin_m) return true;
  }
  return false;
}

}  // namespace

std::vector<std::uint8_t> FramesInMidAir(const Clip& clip, const BodySurface& body,
                                         const TriangleMesh& object,
                                         const SignedDistance& distance) {
  std::vector<std::uint8_t> in_air(clip.pose.size(), 0);
  const TriangleMesh* const table = TableMesh(clip);
  if (!clip.object || (clip.table && table == nullptr)) return in_air;
  std::optional<SignedDistance> support;
  if (table != nullptr) support.emplace(*table);
  Eigen::AlignedBox3d box;
  for (const auto& vertex : object.vertices.colwise()) box.extend(Vector3d(vertex));
  const Vector3d center = box.center();
  box.min().array() -= kSkin_m;
  box.max().array() += kSkin_m;
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    if (Speed(clip, center, t) > kStill_m_s) continue;
    const Eigen::Matrix3Xd placed = clip.object->Pose(t) * object.vertices;
    const double lowest = placed.row(2).minCoeff();
    if (lowest < kSupport_m) continue;
    const auto rests = [&](const auto& vertex) {
      return vertex.z() < lowest + 0.005 &&
             support->Distance(clip.table->Pose(t).inverse() * Vector3d(vertex)) < kSupport_m;
    };
    if (support && std::ranges::any_of(placed.colwise(), rests)) continue;
    Forward(body, clip.pose[t], clip.trans.col(t), state);
    in_air[t] = TouchesSkin(state, clip.object->Pose(t), box, distance) ? 0 : 1;
  }
  return in_air;
}

}  // namespace holdfast
