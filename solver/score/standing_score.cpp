// SPDX-License-Identifier: MIT
#include "solver/score/standing_score.h"

#include <algorithm>
#include <cmath>

#include "generator/actions/face_marks.h"
#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/score/object_pose_error.h"
#include "solver/grasp/object_shape.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr double kAtFace_m = 0.3, kEnd_s = 0.2, kCell_m = 0.003;
constexpr std::size_t kMaxPlaces = 1000;  // of a range; longer clips are sampled evenly

// Largest distance of two places.
double RangeOf(const std::vector<Vector3d>& places) {
  const std::size_t every = (places.size() + kMaxPlaces - 1) / kMaxPlaces;
  double most = 0.0;
  for (std::size_t a = 0; a < places.size(); a += every) {
    for (std::size_t b = 0; b < a; b += every)
      most = std::max(most, (places[a] - places[b]).norm());
  }
  return most;
}

// Largest distance of two positions of a joint; `flat`: along the ground.
double RangeOf(const std::vector<JointPositions>& joints, int joint, bool flat) {
  std::vector<Vector3d> places;
  for (const JointPositions& frame : joints) {
    places.push_back(frame.col(joint));
    if (flat) places.back().z() = 0.0;
  }
  return RangeOf(places);
}

// The wrist that uses the object; that of the other hand is free.
int ActingWrist(const Clip& clip, const std::vector<JointPositions>& joints) {
  const auto frames = [&](std::uint8_t hand) {
    return std::ranges::count_if(clip.holding_hand,
                                 [&](std::uint8_t bits) { return (bits & hand) != 0; });
  };
  const auto right = frames(kHoldsRight), left = frames(kHoldsLeft);
  if (right != left) return right > left ? kRightWrist : kLeftWrist;
  return RangeOf(joints, kRightWrist, false) >= RangeOf(joints, kLeftWrist, false) ? kRightWrist
                                                                                   : kLeftWrist;
}

double AngleOf(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

StandingScore MeasureStanding(const Clip& clip, const std::vector<JointPositions>& joints,
                              const Eigen::Matrix3Xd& rest_joints, const TriangleMesh* object) {
  StandingScore score;
  const int acting = ActingWrist(clip, joints);
  score.pelvis_range_m = RangeOf(joints, kPelvis, true);
  score.free_wrist_range_m =
      RangeOf(joints, acting == kRightWrist ? kLeftWrist : kRightWrist, false);
  const bool sees_object = object != nullptr && clip.object;
  const Vector3d center = sees_object ? Vector3d(MeasureMoments(*object).center) : Vector3d::Zero();
  double sum = 0.0;
  int count = 0;
  std::vector<Vector3d> faces;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    BodyState state;
    ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
    const Eigen::Isometry3d head = state.WorldFromJoint(kHead);
    const Vector3d face = head.linear().col(2);
    faces.push_back(face);
    if (t == 0) {
      const Vector3d trunk = joints[0].col(kNeck) - joints[0].col(kPelvis);
      Vector3d ahead = state.WorldFromJoint(kPelvis).linear().col(2);
      ahead.z() = 0.0;
      score.lean_start_rad = std::atan2(trunk.dot(ahead.normalized()), trunk.z());
      score.head_down_start_rad = std::asin(std::clamp(-face.z(), -1.0, 1.0));
    }
    const Vector3d seen =
        sees_object ? Vector3d(clip.object->Pose(t) * center) : Vector3d(joints[t].col(acting));
    const Vector3d way = seen - head * FaceMarks().eyes;
    if (way.norm() < kAtFace_m) continue;
    sum += AngleOf(face, way);
    ++count;
  }
  score.head_range_rad = 2.0 * std::asin(std::min(1.0, 0.5 * RangeOf(faces)));
  if (count > 0) score.gaze_off_rad = sum / count;
  const int last = clip.NumFrames() - 1;
  const int first = std::max(0, last - static_cast<int>(std::lround(kEnd_s * clip.frame_rate)));
  if (first < last) {
    score.end_speed_m_s =
        (joints[last] - joints[first]).leftCols<kNumBodyJoints>().colwise().norm().maxCoeff() *
        clip.frame_rate / (last - first);
  }
  return score;
}

std::optional<VesselTilt> MeasureVesselTilt(const Clip& clip, const TriangleMesh& object) {
  const DistanceGrid distance(SignedDistance(object), {.cell_m = kCell_m});
  const ObjectOpening opening = FindOpening(ObjectShape(object, distance));
  if (!opening.Any()) return std::nullopt;
  VesselTilt tilt;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const double angle = AngleOf(clip.object->Pose(t).linear() * opening.up, Vector3d::UnitZ());
    if (t == 0) tilt.start_rad = angle;
    tilt.max_rad = std::max(tilt.max_rad, angle);
  }
  return tilt;
}

}  // namespace holdfast
