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
    throw Error("motion metrics", "has no frames, or a frame rate that is not positive", "");
  }
  const double r = frame_rate_hz;
  MotionMetrics metrics;
  metrics.joint_acceleration_m_s2 = Difference<3>(frames, {r * r, -2.0 * r * r, r * r});
  const double r3 = r * r * r;
  metrics.joint_jerk_m_s3 = Difference<5>(frames, {-0.5 * r3, r3, 0.0, -r3, 0.5 * r3});

  const int num_frames = static_cast<int>(frames.size());
  for (const int foot : kBallsOfFeet) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const JointPositions& frame : frames) lowest = std::min(lowest, frame(2, foot));
    for (int t = 0; t < num_frames; ++t) {
      const double height = frames[t](2, foot) - lowest;
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
  if (num_frames > 1) metrics.foot_skate_mm_per_frame /= 2.0 * (num_frames - 1);
  return metrics;
}

namespace {

// Mean distance after both point sets are translated so that their first points coincide.
template <typename Points>
double AlignedError_mm(const Points& a, const Points& b) {
  const Eigen::Vector3d shift = b.col(0) - a.col(0);
  return 1e3 * ((a.colwise() + shift) - b).colwise().norm().mean();
}

}  // namespace

std::array<int, 5> FingertipVertices(const BodyModel& model, Side side) {
  // Skinning weights belong to a surface, so one of this hand is built, without shape.
  const std::vector<int>& ids = model.HandVertexIds(side);
  const std::shared_ptr<const BodyModel> unowned(std::shared_ptr<void>(), &model);
  const BodySurface hand(unowned, {}, ids);
  std::array<int, 5> tips;
  for (int finger = 0; finger < 5; ++finger) {
    const int last = HandBegin(side) + 3 * finger + 2;
    const Eigen::Vector3d at = hand.RestJoints().col(last);
    const Eigen::Vector3d along = at - hand.RestJoints().col(last - 1);
    double farthest = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < hand.NumVertices(); ++i) {
      const auto weights = hand.Weights(i);
      const auto most = std::max_element(weights.begin(), weights.end(),
                                         [](auto& a, auto& b) { return a.second < b.second; });
      if (most == weights.end() || most->first != last) continue;
      const double reach = along.dot(hand.RestVertices().col(i) - at);
      if (reach <= farthest) continue;
      farthest = reach;
      tips[finger] = ids[i];
    }
    if (!(farthest > 0.0)) {
      throw Error(model.Name(), "has no vertex on a finger's last phalanx",
                  "Give a body model with hands");
    }
  }
  return tips;
}

std::vector<BodyPoints> BodyTrajectory(const Clip& clip,
                                       const std::shared_ptr<const BodyModel>& model,
                                       const Eigen::VectorXd& betas) {
  std::vector<int> tips;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    for (const int vertex : FingertipVertices(*model, side)) tips.push_back(vertex);
  }
  const BodySurface surface(model, betas, tips);
  std::vector<BodyPoints> frames(static_cast<std::size_t>(clip.NumFrames()));
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    BodyPoints& points = frames[t];
    points.joints = state.joints.leftCols<kNumBodyJoints>();
    for (const Side side : {Side::kRight, Side::kLeft}) {
      HandPoints& hand = side == Side::kRight ? points.right : points.left;
      hand << state.joints.col(WristJoint(side)),
          state.joints.middleCols<kJointsPerHand>(HandBegin(side)),
          state.vertices.middleCols<5>(side == Side::kRight ? 0 : 5);
    }
  }
  return frames;
}

JointError CompareJoints(const BodyPoints& points, const BodyPoints& reference) {
  JointError error;
  error.global = 1e3 * (points.joints - reference.joints).colwise().norm().mean();
  error.root_aligned = AlignedError_mm(points.joints, reference.joints);
  error.right_hand = AlignedError_mm(points.right, reference.right);
  error.left_hand = AlignedError_mm(points.left, reference.left);
  return error;
}

}  // namespace holdfast
