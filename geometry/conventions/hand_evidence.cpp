// SPDX-License-Identifier: MIT
#include "geometry/conventions/hand_evidence.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/body/hand_model.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kMaxEvidence = 3000;

// Poses of the wrists (right, left) and of the object in some frames.
struct Tracks {
  std::array<std::vector<Eigen::Matrix3d>, 2> wrist_rotation;
  std::array<std::vector<Eigen::Vector3d>, 2> in_wrist;  // the object in the wrist's frame, meters
  std::vector<Eigen::Matrix3d> rotation;
  std::vector<Eigen::Vector3d> position;
  int lag = 1;  // samples in a fifth of a second
};

Tracks Follow(const LooseMotion& motion, const BodyModel& body, double meters_per_unit) {
  const Eigen::Matrix3Xd rest = body.RestJoints(body.Template());
  const int step = std::max(1, motion.frames / kMaxEvidence);
  const double rate = (motion.frame_rate > 0 ? motion.frame_rate : 30.0) / step;
  Tracks tracks;
  tracks.lag = std::max(1, static_cast<int>(std::lround(0.2 * rate)));
  BodyState state;
  for (int t = 0; t < motion.frames; t += step) {
    ForwardJoints(rest, motion.pose[t], meters_per_unit * motion.trans.col(t), state);
    const Eigen::Vector3d position = meters_per_unit * motion.object_trans.col(t);
    tracks.position.push_back(position);
    tracks.rotation.push_back(motion.object_rotation[t]);
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const auto h = static_cast<std::size_t>(side);
      const int joint = WristJoint(side);
      tracks.wrist_rotation[h].push_back(state.world_rotation[joint]);
      tracks.in_wrist[h].push_back(state.world_rotation[joint].transpose() *
                                   (position - state.joints.col(joint)));
    }
  }
  return tracks;
}

}  // namespace

HandMeanEvidence JudgeHandMean(const LooseMotion& motion, const BodyModel& body) {
  using Reading = HandMeanEvidence::Reading;
  HandMeanEvidence evidence;
  if (!motion.has_hands || motion.frames == 0) return evidence;
  evidence.from_zero = evidence.from_mean = 1e300;
  bool all_zero = true;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const FingerPose mean = body.HandMean(side);
    const double size = mean.norm();
    if (size < 1e-6) return evidence;  // the model has no mean hand
    FingerPose first = FingersOf(motion.pose[0], side);
    double largest = 0.0, from_zero = 1e300, from_mean = 1e300;
    for (const JointPose& pose : motion.pose) {
      const FingerPose fingers = FingersOf(pose, side);
      largest = std::max(largest, fingers.norm());
      from_zero = std::min(from_zero, fingers.norm() / size);
      from_mean = std::min(from_mean, (fingers - mean).norm() / size);
      if ((fingers - first).cwiseAbs().maxCoeff() > 1e-3) evidence.moves = true;
    }
    if (largest < 1e-6) continue;  // not captured
    all_zero = false;
    evidence.from_zero = std::min(evidence.from_zero, from_zero);
    evidence.from_mean = std::min(evidence.from_mean, from_mean);
  }
  if (all_zero) {
    evidence.reading = Reading::kZero;
    evidence.from_zero = 0.0;
    evidence.from_mean = 1.0;
    return evidence;
  }
  // A hand at rest is near one of the two, whose distance is 1. Being within half of both is not a
  // contradiction; being twice as near to one is a decision.
  const double near = std::min(evidence.from_zero, evidence.from_mean);
  const double far = std::max(evidence.from_zero, evidence.from_mean);
  evidence.reading = Reading::kUndecided;
  if (near < 0.6 && near < 0.5 * far) {
    evidence.reading =
        evidence.from_mean < evidence.from_zero ? Reading::kFull : Reading::kRelative;
    evidence.certain = near < 0.35 && far > 0.7;
  }
  return evidence;
}

ObjectEvidence JudgeObject(const LooseMotion& motion, const BodyModel& body,
                           double meters_per_unit) {
  ObjectEvidence evidence;
  if (!motion.has_object || motion.frames < 2) return evidence;
  const Tracks tracks = Follow(motion, body, meters_per_unit);
  const auto lag = static_cast<std::size_t>(tracks.lag);
  constexpr double kMoved_m = 0.02, kTurned_rad = 0.1;  // per step: the object moves
  constexpr double kStays_m = 0.02;                     // in the wrist's frame: the object is held
  constexpr double kReach_m = 0.35;                     // wrist to the origin of a held object

  int moving = 0;
  std::array<int, 2> carried = {0, 0};
  std::array<double, 2> column = {0, 0}, row = {0, 0};
  std::array<int, 2> turning = {0, 0};
  std::array<std::vector<double>, 2> distance;
  for (std::size_t t = 0; t < tracks.position.size(); ++t) {
    for (const int h : {0, 1}) distance[h].push_back(tracks.in_wrist[h][t].norm());
    if (t + lag >= tracks.position.size()) continue;
    const std::size_t u = t + lag;
    const double turn = AngleBetween(tracks.rotation[t], tracks.rotation[u]);
    const double move = (tracks.position[t] - tracks.position[u]).norm();
    if (move < kMoved_m && turn < kTurned_rad) continue;
    ++moving;
    for (const int h : {0, 1}) {
      const std::vector<Eigen::Vector3d>& object = tracks.in_wrist[h];
      if ((object[t] - object[u]).norm() > kStays_m || object[t].norm() > kReach_m) {
        continue;
      }
      ++carried[h];
      if (turn < kTurned_rad) continue;
      ++turning[h];
      // The object in the wrist's frame, its rotation as stored or transposed.
      const std::vector<Eigen::Matrix3d>& wrist = tracks.wrist_rotation[h];
      const auto drift = [&](bool transposed) {
        Eigen::Matrix3d a = tracks.rotation[t], b = tracks.rotation[u];
        if (transposed) {
          a.transposeInPlace();
          b.transposeInPlace();
        }
        return AngleBetween(wrist[t].transpose() * a, wrist[u].transpose() * b);
      };
      column[h] += drift(false);
      row[h] += drift(true);
    }
  }
  const int h = carried[1] > carried[0] ? 1 : 0;
  evidence.moves = moving > 0;
  if (moving > 0 && 4 * carried[h] >= moving) {
    evidence.holder = h == 1 ? Side::kLeft : Side::kRight;
    evidence.holder_share = double(carried[h]) / moving;
    evidence.wrist_distance_m = Median(distance[h]);
  } else {
    evidence.wrist_distance_m = std::min(Median(distance[0]), Median(distance[1]));
  }
  evidence.steps = turning[h];
  if (turning[h] == 0) return evidence;
  evidence.column_drift_rad = column[h] / turning[h];
  evidence.row_drift_rad = row[h] / turning[h];
  constexpr int kEnough = 5;
  constexpr double kApart_rad = 0.05;
  const double less = std::min(evidence.column_drift_rad, evidence.row_drift_rad);
  const double more = std::max(evidence.column_drift_rad, evidence.row_drift_rad);
  if (turning[h] >= kEnough && more - less > kApart_rad && less < 0.5 * more) {
    evidence.convention = evidence.column_drift_rad < evidence.row_drift_rad
                              ? ObjectEvidence::Convention::kColumn
                              : ObjectEvidence::Convention::kRow;
  }
  return evidence;
}

}  // namespace holdfast
