// SPDX-License-Identifier: MIT
#include "generator/training/wandr/goal_loss.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace holdfast::wandr {
namespace {

using Eigen::Vector3f;

constexpr int kBeforeDeadline = 20;  // frames
constexpr float kSharpness = 0.2f, kNear = 0.03f;
constexpr float kSlideFree = 0.004f, kSlideUnit = 0.004f;  // meters a frame
constexpr float kHeightUnit = 0.02f, kAirborne = 0.05f;    // meters
constexpr float kFastest = 1.6f / 30.0f, kSpeedUnit = 0.5f / 30.0f;
constexpr std::array<int, 4> kFeet = {kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot};
// A hinge's square grows no faster than linearly beyond this many units.
constexpr float kLinearFrom = 3.0f;

struct Hinge {
  explicit Hinge(float units) {
    const float u = std::max(units, 0.0f);
    if (u < kLinearFrom) {
      value = 0.5f * u * u;
      slope = u;
    } else {
      value = kLinearFrom * (u - 0.5f * kLinearFrom);
      slope = kLinearFrom;
    }
  }
  float value, slope;
};

}  // namespace

double AddGoalLoss(std::span<const BodyJoints<float>> joints, const Vector3f& goal, int deadline,
                   int wrist_joint, const FootHeights& standing, const GoalLossWeights& weights,
                   float scale, std::span<BodyJoints<float>> bars) {
  const int last = static_cast<int>(joints.size()) - 1;
  double loss = 0.0;

  const int first = std::clamp(deadline - kBeforeDeadline, 1, last);
  std::vector<float> squared;
  for (int t = first; t <= last; ++t) {
    squared.push_back((joints[t].col(wrist_joint) - goal).squaredNorm());
  }
  const float least = *std::min_element(squared.begin(), squared.end());
  float total = 0.0f;
  std::vector<float> share;
  for (const float d : squared) {
    share.push_back(std::exp(-(d - least) / (kSharpness * kSharpness)));
    total += share.back();
  }
  for (int t = first; t <= last; ++t) {
    const Vector3f off = joints[t].col(wrist_joint) - goal;
    const float distance = std::sqrt(squared[t - first] + kNear * kNear);
    const float weight = weights.distance * share[t - first] / total;
    loss += weight * distance;
    bars[t].col(wrist_joint) += (scale * weight / distance) * off;
  }

  const float per_frame = 1.0f / static_cast<float>(last);
  const auto height = [&](int t, int k) {
    return joints[t](2, k) - (k < 10 ? standing.ankle : standing.ball);
  };
  for (int t = 1; t <= last; ++t) {
    int lowest = kFeet[0];
    for (const int k : kFeet) {
      if (height(t, k) < height(t, lowest)) lowest = k;
      const Hinge below(-height(t, k) / kHeightUnit);
      loss += weights.floor * per_frame * below.value;
      bars[t](2, k) -= scale * weights.floor * per_frame * below.slope / kHeightUnit;
    }
    const Hinge above((height(t, lowest) - kAirborne) / kHeightUnit);
    loss += weights.airborne * per_frame * above.value;
    bars[t](2, lowest) += scale * weights.airborne * per_frame * above.slope / kHeightUnit;

    const auto moves = [&](int k, float free, float unit, float weight) {
      const Eigen::Vector2f step = (joints[t].col(k) - joints[t - 1].col(k)).head<2>();
      const float length = step.norm();
      const Hinge hinge((length - free) / unit);
      if (hinge.slope == 0.0f) return;
      loss += weight * per_frame * hinge.value;
      const Eigen::Vector2f bar = (scale * weight * per_frame * hinge.slope / unit / length) * step;
      bars[t].col(k).head<2>() += bar;
      bars[t - 1].col(k).head<2>() -= bar;
    };
    moves(lowest, kSlideFree, kSlideUnit, weights.skating);
    moves(0, kFastest, kSpeedUnit, weights.speed);
  }
  return loss;
}

}  // namespace holdfast::wandr
