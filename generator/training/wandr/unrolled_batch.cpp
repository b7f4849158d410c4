// SPDX-License-Identifier: MIT
#include "generator/training/wandr/unrolled_batch.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <Eigen/Geometry>

#include "generator/wandr/pose.h"
#include "geometry/parallel.h"

namespace holdfast::wandr {
namespace {

constexpr int kChunk = 16;  // bodies per task
constexpr int kFootJoints[] = {kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot};
constexpr float kPositionUnit = 0.02f, kFootUnit = 0.004f;  // meters
// A foot of the truth stands: it moves less than this in a frame, meters along the ground.
constexpr float kStandingStep = 0.005f;

// rho of a squared error, and its slope.
struct Robust {
  explicit Robust(float squared) {
    const float root = std::sqrt(1.0f + squared / 9.0f);
    value = 18.0f * (root - 1.0f);
    slope = 1.0f / root;
  }
  float value, slope;
};

// weight * rho(|e|^2 / (3 unit^2)); returns it and adds its gradient to `bar`.
double AddRobust(const Vector3<float>& e, float unit, float weight, Vector3<float>& bar) {
  const float scale = 1.0f / (3.0f * unit * unit);
  const Robust robust(e.squaredNorm() * scale);
  bar += (2.0f * weight * robust.slope * scale) * e;
  return static_cast<double>(weight) * static_cast<double>(robust.value);
}

// The pose `perturbation` takes a true one to, `frame` frames after frame 0.
Pose<float> Perturbed(const Pose<float>& truth, const TangentVector<float>& perturbation,
                      float frame) {
  if (perturbation.isZero(0.0f)) return truth;
  const float left = std::exp(-frame / kRecoveryFrames);
  Pose<float> pose = truth;
  pose.translation.z() += left * perturbation[2];
  for (int k = 0; k < kNumBodyJoints; ++k) {
    const Vector3<float> turn = left * perturbation.segment<3>(TangentOf(k));
    const float angle = turn.norm();
    if (angle > 0.0f) {
      pose.rotation[k] = truth.rotation[k] * Eigen::AngleAxisf(angle, turn / angle).matrix();
    }
  }
  return pose;
}

template <typename Body>
void ForBodies(int count, int threads, const Body& body) {
  ParallelFor((count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    const int end = std::min(count, (chunk + 1) * kChunk);
    for (int i = chunk * kChunk; i < end; ++i) body(i);
  });
}

}  // namespace

UnrolledBatch::UnrolledBatch(const Statistics& statistics, const BoneOffsets<float>& bones,
                             IntentionLayout layout, const IntentionOptions& intention,
                             int max_bodies, int max_steps)
    : norms_(statistics),
      bones_(bones),
      layout_(layout),
      intention_(intention),
      max_bodies_(max_bodies),
      truth_(static_cast<std::size_t>(max_bodies) * (max_steps + 1)),
      poses_(truth_.size()),
      placed_(poses_.size()),
      joints_bar_(poses_.size()),
      deltas_(kStateSize, static_cast<Eigen::Index>(poses_.size())) {}

void UnrolledBatch::Begin(std::span<const TrainingWindow> windows, int steps) {
  assert(static_cast<int>(windows.size()) <= max_bodies_);
  windows_.assign(windows.begin(), windows.end());
  steps_ = steps;
  const int count = NumBodies();
  pose_bar_.setZero(kTangentSize, count);
  previous_bar_.setZero(kStateSize, count);
  for (int a = 0; a <= steps; ++a) {
    for (int i = 0; i < count; ++i) joints_bar_[Index(i, a)].setZero();
  }
  for (int i = 0; i < count; ++i) {
    const TrainingWindow& window = windows_[i];
    for (int a = 0; a <= (window.free ? 0 : steps); ++a) {
      truth_[Index(i, a)] = Perturbed(window.truth[a], window.perturbation, static_cast<float>(a));
    }
    poses_[Index(i, 0)] = truth_[Index(i, 0)];
    ForwardKinematics(bones_, poses_[Index(i, 0)], placed_[Index(i, 0)]);
    const StateVector<float> led_here =
        window.before ? DeltaBetween(Perturbed(*window.before, window.perturbation, -1.0f),
                                     poses_[Index(i, 0)])
                      : RestDelta<float>();
    deltas_.col(Index(i, 0)) = NormalizedDelta<float>(norms_, led_here);
  }
}

void UnrolledBatch::WriteInputs(int step, Eigen::Ref<Matrix> conditions, Eigen::Ref<Matrix> targets,
                                int threads) {
  ForBodies(NumBodies(), threads, [&](int i) {
    const TrainingWindow& window = windows_[i];
    const Pose<float>& pose = poses_[Index(i, step)];
    const BodyJoints<float>& joints = placed_[Index(i, step)].joints;
    const Heading<float> heading = HeadingOf<float>(pose.rotation[0]);
    float* const condition = conditions.col(i).data();
    WritePoseFeatures(pose, heading, norms_, condition);
    Eigen::Map<StateVector<float>>{condition + kPreviousDeltaOf} = deltas_.col(Index(i, step));
    WriteIntention<float>(layout_,
                          {heading, joints.col(0), joints.col(WristJoint(intention_.wrist))},
                          GoalAt<float>(window.plan, step, intention_), condition + kIntentionOf);
    if (window.free) {
      targets.col(i).setZero();
    } else {
      targets.col(i) =
          NormalizedDelta<float>(norms_, DeltaBetween(pose, truth_[Index(i, step + 1)]));
    }
  });
}

double UnrolledBatch::Advance(int step, const Eigen::Ref<const Matrix>& deltas,
                              const JointLossWeights& losses,
                              const Eigen::Ref<const Eigen::VectorXf>& weights, int threads) {
  std::vector<double> sums(windows_.size(), 0.0);
  ForBodies(NumBodies(), threads, [&](int i) {
    const TrainingWindow& window = windows_[i];
    const std::size_t now = Index(i, step), next = Index(i, step + 1);
    deltas_.col(next) = deltas.col(i);
    ApplyDelta<float>(poses_[now], HeadingOf<float>(poses_[now].rotation[0]),
                      DeltaOfNormalized<float>(norms_, deltas.col(i)), poses_[next]);
    ForwardKinematics(bones_, poses_[next], placed_[next]);
    if (window.free) return;
    BodyKinematics<float> true_now, true_next;
    ForwardKinematics(bones_, truth_[now], true_now);
    ForwardKinematics(bones_, truth_[next], true_next);
    double sum = 0.0;
    const auto add = [&](int joint, const Vector3<float>& error, float unit, float weight,
                         bool moving) {
      Vector3<float> bar = Vector3<float>::Zero();
      sum += AddRobust(error, unit, weights[i] * weight, bar);
      joints_bar_[next].col(joint) += bar;
      if (moving) joints_bar_[now].col(joint) -= bar;
    };
    for (int k = 0; k < kNumBodyJoints; ++k) {
      add(k, placed_[next].joints.col(k) - true_next.joints.col(k), kPositionUnit,
          losses.position / kNumBodyJoints, false);
    }
    for (const int k : kFootJoints) {
      const Vector3<float> moved = placed_[next].joints.col(k) - placed_[now].joints.col(k);
      const Vector3<float> truly = true_next.joints.col(k) - true_now.joints.col(k);
      add(k, moved - truly, kFootUnit, losses.foot_velocity / std::size(kFootJoints), true);
      if (truly.head<2>().norm() < kStandingStep) {
        const Vector3<float> slip(moved.x(), moved.y(), 0.0f);
        add(k, slip, kFootUnit, losses.foot_contact / std::size(kFootJoints), true);
      }
    }
    sums[i] = sum;
  });
  double total = 0.0;
  for (const double sum : sums) total += sum;
  return total;
}

double UnrolledBatch::JudgeByGoals(const GoalLossWeights& losses, const FootHeights& standing,
                                   float weight, int threads) {
  std::vector<double> sums(windows_.size(), 0.0);
  ForBodies(NumBodies(), threads, [&](int i) {
    const TrainingWindow& window = windows_[i];
    if (!window.free || window.plan.empty()) return;
    std::vector<BodyJoints<float>> joints(steps_ + 1), bars(steps_ + 1);
    for (int a = 0; a <= steps_; ++a) {
      joints[a] = placed_[Index(i, a)].joints;
      bars[a].setZero();
    }
    const Waypoint& goal = window.plan.front();
    sums[i] = weight * AddGoalLoss(joints, goal.position.cast<float>(), goal.frame,
                                   WristJoint(intention_.wrist), standing, losses, weight, bars);
    for (int a = 0; a <= steps_; ++a) joints_bar_[Index(i, a)] += bars[a];
  });
  double total = 0.0;
  for (const double sum : sums) total += sum;
  return total;
}

void UnrolledBatch::OutputGradient(int step, Eigen::Ref<Matrix> deltas_bar, int threads) {
  ForBodies(NumBodies(), threads, [&](int i) {
    const std::size_t now = Index(i, step), next = Index(i, step + 1);
    TangentVector<float> next_bar = pose_bar_.col(i);
    ForwardKinematicsVjp<float>(placed_[next], joints_bar_[next], next_bar);
    TangentVector<float> bar = TangentVector<float>::Zero();
    StateVector<float> step_bar;
    ApplyDeltaVjp<float>(HeadingOf<float>(poses_[now].rotation[0]),
                         DeltaOfNormalized<float>(norms_, deltas_.col(next)), next_bar, false, bar,
                         step_bar);
    pose_bar_.col(i) = bar;
    deltas_bar.col(i) = step_bar.cwiseProduct(norms_.delta.deviation) + previous_bar_.col(i);
  });
}

void UnrolledBatch::ConditionGradient(int step, const Eigen::Ref<const Matrix>& conditions_bar,
                                      float largest, int threads) {
  const int wrist = WristJoint(intention_.wrist);
  ForBodies(NumBodies(), threads, [&](int i) {
    const std::size_t now = Index(i, step);
    const Pose<float>& pose = poses_[now];
    const Heading<float> heading = HeadingOf<float>(pose.rotation[0]);
    const float* const condition_bar = conditions_bar.col(i).data();
    TangentVector<float> bar = pose_bar_.col(i);
    WritePoseFeaturesVjp<float>(pose, heading, norms_, condition_bar, bar);
    previous_bar_.col(i) = Eigen::Map<const StateVector<float>>(condition_bar + kPreviousDeltaOf);
    const FrameGoal<float> goal = GoalAt<float>(windows_[i].plan, step, intention_);
    if (goal.active) {
      const BodyJoints<float>& joints = placed_[now].joints;
      IntentionBar<float> intention;
      WriteIntentionVjp<float>(layout_, {heading, joints.col(0), joints.col(wrist)}, goal,
                               condition_bar + kIntentionOf, intention);
      BodyJoints<float> joints_bar = BodyJoints<float>::Zero();
      joints_bar.col(0) = intention.pelvis;
      joints_bar.col(wrist) += intention.wrist;
      bar.segment<3>(TangentOf(0)) += intention.turn * heading.gradient;
      ForwardKinematicsVjp<float>(placed_[now], joints_bar, bar);
    }
    const float norm = bar.norm();
    if (!std::isfinite(norm)) {
      bar.setZero();
    } else if (norm > largest) {
      bar *= largest / norm;
    }
    pose_bar_.col(i) = bar;
  });
}

}  // namespace holdfast::wandr
