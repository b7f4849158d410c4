// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/motion_metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/body/body_model.h"
#include "geometry/error.h"

namespace holdfast {
namespace {

constexpr double kContactHeight = 0.025;  // meters
constexpr double kPlantedHeight = 0.005;
constexpr std::array<int, 2> kBallsOfFeet = {10, 11};

// Norm of a finite difference per joint and frame; weights are for frames t - radius .. t + radius.
template <std::size_t N>
MeanAndMax Difference(std::span<const JointPositions> frames,
                      const std::array<double, N>& weights) {
  const int radius = static_cast<int>(N / 2);
  const int count = static_cast<int>(frames.size()) - 2 * radius;
  MeanAndMax result;
  if (count <= 0) return result;
  for (int t = 0; t < count; ++t) {
    Eigen::Matrix<double, 3, kNumBodyJoints> d = Eigen::Matrix<double, 3, kNumBodyJoints>::Zero();
    for (std::size_t k = 0; k < N; ++k) {
      d += weights[k] * frames[t + k].leftCols<kNumBodyJoints>();
    }
    result.mean += d.colwise().norm().mean();
    result.max = std::max(result.max, d.colwise().norm().maxCoeff());
  }
  result.mean /= count;
  return result;
}

}  // namespace

std::vector<JointPositions> JointTrajectory(const Clip& clip, const Eigen::Matrix3Xd& rest_joints) {
  std::vector<JointPositions> frames;
  frames.reserve(clip.pose.size());
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(rest_joints, clip.pose[t], clip.trans.col(t), state);
    frames.push_back(state.joints);
  }
  return frames;
}

MotionMetrics MeasureMotion(std::span<const JointPositions> frames, double frame_rate_hz) {
  if (frames.empty() || !(frame_rate_hz > 0.0)) {
    throw Error("motion metrics", "no frames or a frame rate that is not positive", "");
  }
  const double r = frame_rate_hz;
  MotionMetrics metrics;
  metrics.joint_speed_m_s = Difference<3>(frames, {-0.5 * r, 0.0, 0.5 * r});
  metrics.joint_acceleration_m_s2 = Difference<3>(frames, {r * r, -2.0 * r * r, r * r});
  const double r3 = r * r * r;
  metrics.joint_jerk_m_s3 = Difference<5>(frames, {-0.5 * r3, r3, 0.0, -r3, 0.5 * r3});

  const int num_frames = static_cast<int>(frames.size());
  int in_contact = 0;
  for (const int foot : kBallsOfFeet) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const JointPositions& frame : frames) lowest = std::min(lowest, frame(2, foot));
    for (int t = 0; t < num_frames; ++t) {
      const double height = frames[t](2, foot) - lowest;
      in_contact += height < kContactHeight ? 1 : 0;
      if (t + 1 == num_frames) continue;
      const double way = (frames[t + 1].col(foot) - frames[t].col(foot)).head<2>().norm();
      if (height < kContactHeight) {
        metrics.foot_skate_mm_per_frame += 1e3 * way * (2.0 - std::exp2(height / kContactHeight));
      }
      if (std::max(height, frames[t + 1](2, foot) - lowest) < kPlantedHeight) {
        metrics.foot_slide_max_mm_per_frame =
            std::max(metrics.foot_slide_max_mm_per_frame, 1e3 * way);
      }
    }
  }
  metrics.foot_contact_ratio = in_contact / (2.0 * num_frames);
  if (num_frames > 1) metrics.foot_skate_mm_per_frame /= 2.0 * (num_frames - 1);
  return metrics;
}

}  // namespace holdfast
