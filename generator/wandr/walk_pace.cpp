// SPDX-License-Identifier: MIT
#include "generator/wandr/walk_pace.h"

#include <algorithm>
#include <cmath>

#include "generator/wandr/intention.h"
#include "generator/wandr/pose.h"

namespace holdfast::wandr {
namespace {

using Eigen::Vector2d;

constexpr double kTick = 1.0 / kFramesPerSecond;
constexpr int kMaxFrames = 3000;
constexpr double kThere = 0.03;        // meters
constexpr double kStance = 0.45;       // meters from the pelvis to a goal that is reached standing
constexpr double kClose = 0.3;         // meters to there: closer, no turn is needed to walk on
constexpr double kCruise = 1.55;       // m/s
constexpr double kGain = 3.0;          // m/s^2, setting off
constexpr double kBrake = 2.7;         // m/s^2
constexpr double kTurning = 0.9;       // rad/s
constexpr double kTurnGain = 4.0;      // 1/s, gain on the remaining angle
constexpr double kTurnChange = 8.0;    // rad/s^2
constexpr double kFreeTurn = 0.5;      // radians that a goal may be to the side
constexpr double kWhileTurning = 1.5;  // larger: faster walking while turning
constexpr double kReach = 0.6;         // seconds from the last step on
constexpr double kLeast = 40.0;        // frames

double AngleFrom(const Vector2d& a, const Vector2d& b) {
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

}  // namespace

WalkPace::WalkPace(const Vector2d& from, const Vector2d& facing, const Vector2d& velocity,
                   const Vector2d& goal) {
  Vector2d p = from, v = velocity;
  if (v.norm() > kCruise) v *= kCruise / v.norm();
  double yaw = std::atan2(facing.y(), facing.x()), rate = 0.0;
  const auto facing_of = [](double a) { return Vector2d(std::cos(a), std::sin(a)); };
  stands_.push_back({p, facing_of(yaw), v.norm()});
  for (int t = 0; t < kMaxFrames; ++t) {
    const Vector2d way = goal - p, face = facing_of(yaw);
    const double left = way.norm() - kStance;
    const double angle = way.norm() > 1e-6 ? AngleFrom(face, way) : 0.0;
    // At arrival the body need not face the goal.
    const double off =
        left > kClose ? angle : std::copysign(std::max(0.0, std::abs(angle) - kFreeTurn), angle);
    if (left < kThere && std::abs(off) < 0.1) break;
    const double wanted_rate = std::clamp(kTurnGain * off, -kTurning, kTurning);
    rate += std::clamp(wanted_rate - rate, -kTurnChange * kTick, kTurnChange * kTick);
    yaw += rate * kTick;
    double speed =
        kCruise * std::max(0.0, (std::cos(angle) + kWhileTurning) / (1.0 + kWhileTurning));
    const double brake = std::sqrt(2.0 * kBrake * std::max(0.0, left - 0.5 * kThere));
    // On the last short stretch the pelvis moves to the goal regardless of facing.
    const double near = std::clamp(1.0 - (left - kClose) / 0.5, 0.0, 1.0);
    Vector2d ahead = facing_of(yaw);
    if (way.norm() > 1e-6) ahead = ((1.0 - near) * ahead + near * way.normalized()).normalized();
    if (near > 0.0) speed = std::max(speed, near * 0.5 * kCruise);
    speed = std::min(speed, brake);
    Vector2d change = speed * ahead - v;
    const double most = kGain * kTick;
    if (v.norm() > brake) {
      v = speed * ahead;
    } else {
      if (change.norm() > most) change *= most / change.norm();
      v += change;
    }
    if (left < kThere) v.setZero();
    p += v * kTick;
    length_m_ += v.norm() * kTick;
    stands_.push_back({p, facing_of(yaw), v.norm()});
  }
  arrival_ = static_cast<int>(stands_.size()) - 1;
}

int WalkPace::Deadline() const {
  const double frames = Arrival() + kReach * kFramesPerSecond;
  return static_cast<int>(std::lround(std::max(frames, kLeast)));
}

WalkPace::Stand WalkPace::At(double frame) const {
  const double at = std::clamp(frame, 0.0, static_cast<double>(arrival_));
  const auto before = static_cast<std::size_t>(at);
  const auto after = std::min(before + 1, stands_.size() - 1);
  const double share = at - static_cast<double>(before);
  const Stand &a = stands_[before], &b = stands_[after];
  return {(1.0 - share) * a.position + share * b.position,
          ((1.0 - share) * a.facing + share * b.facing).normalized(),
          (1.0 - share) * a.speed_m_s + share * b.speed_m_s};
}

Eigen::Vector2d StartVelocity(const Network<float>& network, const RolloutStart<float>& start) {
  const StateVector<float> delta = DeltaOfNormalized<float>(network.Norms(), start.previous_delta);
  const Vector3<float> step = HeadingOf<float>(start.pose.rotation[0]).ToWorld(delta.head<3>());
  return kFramesPerSecond * step.head<2>().cast<double>();
}

WalkPace PaceOf(const RolloutStart<float>& start, const Eigen::Vector3d& pelvis,
                const Eigen::Vector2d& velocity, const Eigen::Vector3d& goal) {
  const Matrix3<float>& root = start.pose.rotation[0];
  return {pelvis.head<2>(), Vector2d(root(0, 2), root(1, 2)), velocity, goal.head<2>()};
}

}  // namespace holdfast::wandr
