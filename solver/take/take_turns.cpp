// SPDX-License-Identifier: MIT
#include "solver/take/take_turns.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "generator/scripted/minimum_jerk.h"
#include "geometry/body/skeleton.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr int kSteps = 10;  // in each direction
constexpr double kStep = 6.0 * kDegree;
constexpr double kFar = 60.0 * kDegree, kFast = 60.0 * kDegree;
constexpr double kBell_s = 0.15, kBegin_s = 0.3;
constexpr std::array<double, 4> kSwivels = {-10.0, 10.0, 30.0, 50.0};  // degrees

double Square(double x) { return x * x; }

Isometry3d Turned(const Isometry3d& pose, const Vector3d& bottom_middle, double turn) {
  const Vector3d about = pose * bottom_middle;
  Isometry3d turned = pose;
  turned.prerotate(Eigen::AngleAxisd(turn, Vector3d::UnitZ()));
  turned.translation() += about - turned * bottom_middle;
  return turned;
}

}  // namespace

void EaseTurns(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
               std::span<const BodyPlacement> body, int take_frame, double frame_rate,
               std::vector<Isometry3d>& way) {
  const int count = static_cast<int>(way.size()) - take_frame;
  if (count < 2) return;
  const Vector3d bottom = object.BottomMiddle();
  constexpr int kStates = 2 * kSteps + 1;
  const double change = Square(kStep * frame_rate / kFast);
  std::array<double, kStates> cost{}, next{};
  std::vector<std::array<int, kStates>> from(static_cast<std::size_t>(count));
  for (int t = 0; t < count; ++t) {
    const BodyPlacement& placed = body[take_frame + t];
    for (int s = 0; s < kStates; ++s) {
      const double turn = kStep * (s - kSteps);
      const ArmTarget target{placed.joints.col(arm.Bones().root), placed.rotation[kSpine3],
                             take.WristFor(Turned(way[take_frame + t], bottom, turn))};
      double here = std::numeric_limits<double>::infinity();
      for (const double swivel : kSwivels) {
        const ArmChoice choice = arm.At(target, swivel * kDegree);
        here = std::min(here, Square(choice.hand_error_rad / (3.0 * kDegree)) +
                                  Square(choice.shortfall_m / 0.02) +
                                  0.1 * std::min(choice.discomfort, 20.0));
      }
      here += Square(turn / kFar);
      double least = t == 0 ? (s == kSteps ? 0.0 : 1e6) : std::numeric_limits<double>::infinity();
      for (int p = 0; t > 0 && p < kStates; ++p) {
        const double total = cost[p] + change * Square(s - p);
        if (total < least) {
          least = total;
          from[t][s] = p;
        }
      }
      next[s] = here + least;
    }
    cost = next;
  }
  std::vector<double> turns(static_cast<std::size_t>(count));
  int at = static_cast<int>(std::ranges::min_element(cost) - cost.begin());
  for (int t = count - 1; t >= 0; --t) {
    turns[t] = kStep * (at - kSteps);
    at = from[t][at];
  }
  const int radius = static_cast<int>(std::lround(3.0 * kBell_s * frame_rate));
  for (int t = 0; t < count; ++t) {
    double sum = 0.0, total = 0.0;
    for (int d = -radius; d <= radius; ++d) {
      const double weight = std::exp(-0.5 * Square(d / (kBell_s * frame_rate)));
      sum += weight * turns[std::clamp(t + d, 0, count - 1)];
      total += weight;
    }
    const double begin = MinimumJerk(t / (kBegin_s * frame_rate));
    way[take_frame + t] = Turned(way[take_frame + t], bottom, begin * sum / total);
  }
}

using Eigen::Isometry3d;
using Eigen::Vector3d;

TakeCandidate ChooseTake(const TakePlan& plan, const TakeObject& object, const ArmIk& arm,
                         const BodyPlacement& body) {
  const Vector3d wrist = body.joints.col(arm.Bones().end);
  TakeCandidate best;
  bool first = true;
  for (const TakeCandidate& candidate : plan.candidates) {
    const int yaws = plan.yaw_is_free ? 72 : 1;
    for (int k = 0; k < yaws; ++k) {
      TakeCandidate tried = candidate;
      if (plan.yaw_is_free) tried.yaw_rad = 2.0 * std::numbers::pi * k / yaws;
      const Isometry3d stands = object.Upright(plan.places.front(), tried.yaw_rad);
      ScoreTake(arm, body.joints.col(arm.Bones().root), body.rotation[kSpine3], stands,
                plan.places.front().z(), tried);
      tried.score -= 2.0 * (tried.WristFor(stands).translation() - wrist).norm();
      const bool sounder = tried.fault.empty() && !best.fault.empty();
      const bool worse = !tried.fault.empty() && best.fault.empty();
      if (first || sounder || (!worse && tried.score > best.score)) best = tried;
      first = false;
    }
  }
  return best;
}

UprightPose ComfortableAt(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
                          const Vector3d& place, const BodyPlacement& body, double usual_yaw) {
  UprightPose best;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 72; ++k) {
    const double yaw = usual_yaw + 2.0 * std::numbers::pi * k / 72;
    const Isometry3d pose = object.Upright(place, yaw);
    const ArmChoice choice =
        arm.Best({body.joints.col(arm.Bones().root), body.rotation[kSpine3], take.WristFor(pose)});
    const double cost = choice.discomfort + 30.0 * choice.shortfall_m;
    if (cost < least) {
      least = cost;
      best = {pose.translation(), yaw};
    }
  }
  return best;
}

}  // namespace holdfast
