// SPDX-License-Identifier: MIT
#include "generator/wandr/reach_outcome.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "generator/wandr/body_kinematics.h"
#include "geometry/error.h"

namespace holdfast::wandr {
namespace {

constexpr std::array kFootJoints = {7, 8, 10, 11};  // ankles and balls of the feet

class JointTrack {
 public:
  explicit JointTrack(const Eigen::Ref<const Eigen::MatrixXf>& joints) : joints_(joints) {}

  Eigen::Vector3d At(int joint, int frame) const {
    return joints_.block<3, 1>(3 * joint, frame).cast<double>();
  }
  /// m/s between a frame and the next.
  double Speed(int joint, int frame) const {
    return (At(joint, frame + 1) - At(joint, frame)).norm() * kFramesPerSecond;
  }
  int LowestFootJoint(int frame) const {
    return *std::min_element(kFootJoints.begin(), kFootJoints.end(), [&](int a, int b) {
      return joints_(3 * a + 2, frame) < joints_(3 * b + 2, frame);
    });
  }
  int FramesThatAreNumbers() const {
    int frames = 0;
    while (frames < joints_.cols() && joints_.col(frames).allFinite()) ++frames;
    return frames;
  }
  double MeanAcceleration(int frames) const {
    if (frames < 3) return 0.0;
    double sum = 0.0;
    for (int f = 1; f + 1 < frames; ++f) {
      for (int k = 0; k < kNumBodyJoints; ++k) {
        sum += (At(k, f + 1) - 2.0 * At(k, f) + At(k, f - 1)).norm();
      }
    }
    return sum * kFramesPerSecond * kFramesPerSecond / (kNumBodyJoints * (frames - 2.0));
  }

 private:
  const Eigen::Ref<const Eigen::MatrixXf>& joints_;
};

void MeasureDistances(const JointTrack& track, int frames, const Eigen::Vector3d& goal, int wrist,
                      ReachOutcome& outcome) {
  const int rest = std::max(0, frames - 1 - static_cast<int>(kFramesPerSecond) / 2);
  outcome.closest_m = std::numeric_limits<double>::infinity();
  for (int f = 0; f < frames; ++f) {
    const double distance = (track.At(wrist, f) - goal).norm();
    if (distance < outcome.closest_m) {
      outcome.closest_m = distance;
      outcome.closest_frame = f;
    }
    if (distance <= kReachedWithin && !outcome.Reached()) outcome.reached_frame = f;
    if (f >= rest) outcome.rest_m = std::max(outcome.rest_m, distance);
    outcome.last_m = distance;
  }
  outcome.speed_at_reach_m_s = std::numeric_limits<double>::quiet_NaN();
  if (outcome.Reached() && frames > 1) {
    outcome.speed_at_reach_m_s = track.Speed(wrist, std::max(outcome.reached_frame - 1, 0));
  }
}

template <typename Values>
double Median(Values values) {
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace

ReachOutcome MeasureReach(const Eigen::Ref<const Eigen::MatrixXf>& joints,
                          const Eigen::Vector3d& goal, Side wrist) {
  const JointTrack track(joints);
  const int frames = track.FramesThatAreNumbers();
  if (joints.rows() != kJointNumbers || frames == 0) {
    throw Error("motion", "it has no frame of 22 joints that are numbers", "Check its start pose");
  }
  if (!goal.allFinite()) {
    throw Error("goal", "it is not finite", "Give three numbers, metres");
  }
  ReachOutcome outcome;
  outcome.diverged = frames < joints.cols();
  MeasureDistances(track, frames, goal, WristJoint(wrist), outcome);
  int skating = 0, airborne = 0;
  for (int f = 0; f < frames; ++f) {
    const int lowest = track.LowestFootJoint(f);
    if (track.At(lowest, f).z() > kAirborneAnkleOrBall) ++airborne;
    if (f + 1 == frames) break;
    const Eigen::Vector3d way = track.At(lowest, f + 1) - track.At(lowest, f);
    if (way.head<2>().norm() > kSkatingPerFrame) ++skating;
    outcome.peak_pelvis_m_s = std::max(outcome.peak_pelvis_m_s, track.Speed(0, f));
  }
  outcome.skating_share = static_cast<double>(skating) / std::max(frames - 1, 1);
  outcome.airborne_share = static_cast<double>(airborne) / frames;
  outcome.mean_acceleration_m_s2 = track.MeanAcceleration(frames);
  return outcome;
}

ReachSummary Summarise(std::span<const ReachOutcome> outcomes) {
  if (outcomes.empty()) {
    throw Error("reach summary", "there are no motions", "Run at least one");
  }
  ReachSummary summary;
  summary.count = static_cast<int>(outcomes.size());
  std::vector<double> distances, peaks;
  int reached = 0, at_end = 0, rests = 0, with_speed = 0;
  double speed = 0.0;
  for (const ReachOutcome& outcome : outcomes) {
    reached += outcome.Reached();
    at_end += outcome.ReachedAtEnd();
    rests += outcome.Rests();
    summary.diverged += outcome.diverged;
    distances.push_back(outcome.closest_m);
    peaks.push_back(outcome.peak_pelvis_m_s);
    summary.distance_mean_m += outcome.closest_m / summary.count;
    summary.skating += outcome.skating_share / summary.count;
    summary.airborne += outcome.airborne_share / summary.count;
    summary.acceleration_m_s2 += outcome.mean_acceleration_m_s2 / summary.count;
    if (std::isfinite(outcome.speed_at_reach_m_s)) {
      speed += outcome.speed_at_reach_m_s;
      ++with_speed;
    }
  }
  summary.success = static_cast<double>(reached) / summary.count;
  summary.success_at_end = static_cast<double>(at_end) / summary.count;
  summary.rests = static_cast<double>(rests) / summary.count;
  summary.distance_median_m = Median(distances);
  summary.peak_pelvis_median_m_s = Median(peaks);
  summary.speed_at_reach_m_s =
      with_speed > 0 ? speed / with_speed : std::numeric_limits<double>::quiet_NaN();
  return summary;
}

}  // namespace holdfast::wandr
