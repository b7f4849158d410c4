// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace holdfast {

/// Where a goal that is seen frame by frame will be: it goes on at the velocity it has, which fades
/// with a time constant of 0.6 s. A goal that jumps (by more than 0.15 m in a frame, 4.5 m/s) has
/// no velocity at first.
class GoalPrediction {
 public:
  /// World, metres, 1/30 s after the one before.
  void See(const Eigen::Vector3d& goal) {
    constexpr double kJump = 0.15, kGain = 0.3;
    const Eigen::Vector3d way = seen_ ? Eigen::Vector3d(goal - goal_) : Eigen::Vector3d::Zero();
    if (way.norm() > kJump) {
      velocity_.setZero();
    } else {
      velocity_ += kGain * (way * kFrameRate - velocity_);
    }
    goal_ = goal;
    seen_ = true;
  }
  /// `frames` from the one seen last.
  Eigen::Vector3d After(double frames) const {
    constexpr double kFade_s = 0.6;
    return goal_ - kFade_s * std::expm1(-frames / (kFrameRate * kFade_s)) * velocity_;
  }
  const Eigen::Vector3d& Velocity() const { return velocity_; }  ///< m/s

 private:
  static constexpr double kFrameRate = 30.0;
  Eigen::Vector3d goal_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
  bool seen_ = false;
};

}  // namespace holdfast
