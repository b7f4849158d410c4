// SPDX-License-Identifier: MIT
#include "solver/take/take_measures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

double Deepest(const Eigen::Matrix3Xd& points, const SideTable& table) {
  double deepest = 0.0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    deepest = std::max(deepest, -table.Distance(points.col(i)));
  }
  return 1000.0 * deepest;
}

// Maximum over all frames and its frame; -1 if all are 0.
void Greatest(const std::vector<double>& values, double& greatest, int& frame) {
  const auto at = std::ranges::max_element(values);
  if (at == values.end() || *at <= 0.0) return;
  greatest = *at;
  frame = static_cast<int>(at - values.begin());
}

}  // namespace

Eigen::Matrix3Xd SkinNearTable(const Clip& clip, const BodySurface& surface,
                               const Vector3d& bottom_middle, int threads) {
  constexpr double kNear = 0.7, kAbove = 0.02;
  std::vector<Eigen::Matrix3Xd> kept(clip.pose.size());
  ParallelFor(clip.NumFrames(), threads, [&](int t) {
    BodyState state;
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    Eigen::Matrix3Xd near(3, state.vertices.cols());
    Eigen::Index count = 0;
    for (Eigen::Index i = 0; i < state.vertices.cols(); ++i) {
      const Vector3d from = state.vertices.col(i) - bottom_middle;
      if (from.z() < kAbove && from.head<2>().norm() < kNear)
        near.col(count++) = state.vertices.col(i);
    }
    near.conservativeResize(3, count);
    kept[t] = std::move(near);
  });
  Eigen::Index total = 0;
  for (const Eigen::Matrix3Xd& points : kept) total += points.cols();
  Eigen::Matrix3Xd all(3, total);
  Eigen::Index at = 0;
  for (const Eigen::Matrix3Xd& points : kept) {
    all.middleCols(at, points.cols()) = points;
    at += points.cols();
  }
  return all;
}

TakeMeasures MeasureTake(const Clip& clip, const BodySurface& surface, Side side,
                         const TakeObject& object, const SideTable& table, int take,
                         const std::vector<int>& goals, const std::vector<Vector3d>& places,
                         int threads) {
  const int count = clip.NumFrames();
  const std::vector<int>& hand = surface.Model().HandVertexIds(side);
  std::vector<double> object_depth(clip.pose.size()), hand_depth(clip.pose.size()),
      body_depth(clip.pose.size());
  TakeMeasures measures;
  measures.tilt_deg.assign(clip.pose.size(), 0.0);
  Eigen::Matrix3Xd bottom(3, count);
  ParallelFor(count, threads, [&](int t) {
    BodyState state;
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    const Eigen::Isometry3d object_pose = clip.object->Pose(t);
    body_depth[t] = Deepest(state.vertices, table);
    hand_depth[t] = Deepest(state.vertices(Eigen::all, hand), table);
    object_depth[t] = Deepest(object_pose * object.mesh.vertices, table);
    measures.tilt_deg[t] =
        std::acos(std::clamp(object_pose.linear()(2, 2), -1.0, 1.0)) * 180.0 / std::numbers::pi;
    bottom.col(t) = object_pose.linear() * object.BottomMiddle() + object_pose.translation();
  });
  Greatest(object_depth, measures.object_in_table_mm, measures.object_in_table_frame);
  Greatest(hand_depth, measures.hand_in_table_mm, measures.hand_in_table_frame);
  Greatest(body_depth, measures.body_in_table_mm, measures.body_in_table_frame);
  for (int t = 0; t < count; ++t) {
    if (t < take) {
      measures.moved_before_take_mm =
          std::max(measures.moved_before_take_mm,
                   1000.0 * (clip.object->trans.col(t) - clip.object->trans.col(0)).norm());
    } else {
      measures.max_tilt_deg = std::max(measures.max_tilt_deg, measures.tilt_deg[t]);
    }
    if (t == 0 || t + 1 == count) continue;
    const double acceleration =
        (bottom.col(t + 1) - 2.0 * bottom.col(t) + bottom.col(t - 1)).norm() * clip.frame_rate *
        clip.frame_rate;
    if (acceleration <= measures.max_acceleration) continue;
    measures.max_acceleration = acceleration;
    measures.max_acceleration_frame = t;
  }
  if (take > 0 && take < count) {
    measures.take_jump_mm =
        1000.0 * (clip.object->trans.col(take) - clip.object->trans.col(take - 1)).norm();
  }
  for (std::size_t g = 0; g < goals.size(); ++g) {
    measures.goal_m.push_back((bottom.col(goals[g]) - places[g + 1]).norm());
  }
  return measures;
}

using Eigen::Matrix3d;
using Eigen::Vector3d;

Clip FitTaken(const TakeMotion& motion, const HandModel& hand, const FitObject& object,
              const FitOptions& options, std::vector<FrameReport>* frames,
              const std::function<bool(int, int)>& progress) {
  constexpr double kRate = 30.0;
  constexpr double kSettle_s = 0.3;
  const int take = motion.times.take, count = motion.clip.NumFrames();
  const Clip held = Slice(motion.clip, take, count);
  const HandModel* hands[] = {&hand};
  const std::vector<std::uint8_t> holding(held.pose.size(), HoldingBit(hand.HandSide()));
  FitResult fitted = FitClip(held, hands, object, holding, options, {}, progress);
  Clip clip = motion.clip;
  // Where the wrist's limits kept the hand off the grasp, the fit may place the object slightly
  // differently: it settles there from its standing pose.
  const Matrix3d stands = ExpSO3(held.object->orient.col(0));
  const Vector3d settle = held.object->trans.col(0) - fitted.clip.object->trans.col(0);
  const Vector3d turn = LogSO3(stands * ExpSO3(fitted.clip.object->orient.col(0)).transpose());
  for (int t = 0; t < fitted.clip.NumFrames(); ++t) {
    clip.pose[take + t] = fitted.clip.pose[t];
    clip.trans.col(take + t) = fitted.clip.trans.col(t);
    const double left = 1.0 - MinimumJerk(t / (kSettle_s * kRate));
    const Eigen::Isometry3d pose = fitted.clip.object->Pose(t);
    clip.object->SetPose(take + t, RigidTransform(ExpSO3(left * turn) * pose.linear(),
                                                  pose.translation() + left * settle));
  }
  if (frames != nullptr) *frames = std::move(fitted.frames);
  return clip;
}

}  // namespace holdfast
