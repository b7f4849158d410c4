// SPDX-License-Identifier: MIT
#include "solver/latent/walk_pace.h"

#include <algorithm>
#include <cmath>

#include "generator/wandr/pose.h"

namespace holdfast {
namespace {

constexpr double kStance = 0.45;   // metres from the pelvis to a goal that is reached standing
constexpr double kCruise = 1.35;   // m/s
constexpr double kRamp = 0.5;      // seconds from a stand to that, and back
constexpr double kFreeTurn = 0.7;  // radians that are turned on the way
constexpr double kTurning = 1.8;   // radians a second
constexpr double kReach = 0.7;     // seconds from the last step on
constexpr double kLeast = 40.0;    // frames

}  // namespace

WalkPace::WalkPace(const Eigen::Vector2d& from, const Eigen::Vector2d& facing,
                   const Eigen::Vector2d& goal)
    : from_(from), direction_(Eigen::Vector2d::Zero()), ramp_s_(kRamp), speed_m_s_(kCruise) {
  const Eigen::Vector2d way = goal - from;
  length_m_ = std::max(0.0, way.norm() - kStance);
  if (way.norm() > 1e-6) direction_ = way.normalized();
  const double angle =
      std::abs(std::atan2(facing.x() * way.y() - facing.y() * way.x(), facing.dot(way)));
  turn_s_ = std::max(0.0, angle - kFreeTurn) / kTurning;
  // Too short a way to come to full speed.
  if (length_m_ < kCruise * kRamp) {
    ramp_s_ = std::sqrt(length_m_ * kRamp / kCruise);
    speed_m_s_ = ramp_s_ * kCruise / kRamp;
  }
  walk_s_ = speed_m_s_ > 1e-6 ? length_m_ / speed_m_s_ + ramp_s_ : 0.0;
}

int WalkPace::Deadline() const {
  const double frames = Arrival() + kReach * wandr::kFramesPerSecond;
  return static_cast<int>(std::lround(std::max(frames, kLeast)));
}

double WalkPace::Arrival() const { return (turn_s_ + walk_s_) * wandr::kFramesPerSecond; }

Eigen::Vector2d WalkPace::PelvisAt(double frame) const {
  const double t = std::clamp(frame / wandr::kFramesPerSecond - turn_s_, 0.0, walk_s_);
  const double rate = ramp_s_ > 0.0 ? speed_m_s_ / ramp_s_ : 0.0, left = walk_s_ - t;
  double along = speed_m_s_ * (t - 0.5 * ramp_s_);
  if (t < ramp_s_) along = 0.5 * rate * t * t;
  if (left < ramp_s_) along = length_m_ - 0.5 * rate * left * left;
  return from_ + along * direction_;
}

}  // namespace holdfast
