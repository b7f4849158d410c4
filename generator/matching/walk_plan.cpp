// SPDX-License-Identifier: MIT
#include "generator/matching/walk_plan.h"

#include <algorithm>
#include <cmath>

namespace holdfast {
namespace {

using Eigen::Vector2d;

constexpr double kStep = 1.0 / 30.0;    // seconds
constexpr double kVelocityTime = 0.25;  // s in which a walker takes up a new velocity
constexpr double kTurnTime = 0.2;       // s, and a new heading
constexpr double kFastestTurn = 3.5;    // rad/s
constexpr double kSlowDown = 0.6;       // m before the target
constexpr double kFaceAsAsked = 0.7;    // m before the target

}  // namespace

Vector2d Facing(double yaw_rad) { return {std::sin(yaw_rad), -std::cos(yaw_rad)}; }

double YawToFace(const Vector2d& direction) { return std::atan2(direction.x(), -direction.y()); }

FuturePath PlanWalk(const WalkState& now, const WalkTarget& target) {
  WalkState walker = now;
  FuturePath path;
  for (int step = 1; step <= 30; ++step) {
    const Vector2d to_go = target.place - walker.place;
    const double distance = to_go.norm();
    const double asked = distance > kFaceAsAsked ? YawToFace(to_go) : target.yaw_rad;
    const double off = std::remainder(asked - walker.yaw_rad, 2.0 * M_PI);
    walker.yaw_rad += std::clamp(off / kTurnTime, -kFastestTurn, kFastestTurn) * kStep;
    Vector2d velocity = Vector2d::Zero();
    if (distance > 1e-6) {
      double speed = target.speed * std::min(1.0, distance / kSlowDown);
      // Who has to turn round does so before walking off.
      if (distance > kFaceAsAsked) speed *= std::clamp(0.35 + 0.65 * std::cos(off), 0.1, 1.0);
      velocity = speed * to_go / distance;
    }
    walker.velocity += (velocity - walker.velocity) * (kStep / kVelocityTime);
    walker.place += walker.velocity * kStep;
    if (step % 10 != 0) continue;
    const int column = step / 10 - 1;
    path.col(column) = Eigen::Rotation2Dd(-now.yaw_rad) * Vector2d(walker.place - now.place);
    path.col(3 + column) = Facing(walker.yaw_rad - now.yaw_rad);
  }
  return path;
}

FuturePath PlanStand() {
  FuturePath path = FuturePath::Zero();
  path.rightCols<3>().row(1).setConstant(-1.0);
  return path;
}

}  // namespace holdfast
