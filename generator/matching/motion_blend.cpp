// SPDX-License-Identifier: MIT
#include "generator/matching/motion_blend.h"

#include <algorithm>

#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Faster differences are noise of a capture rather than motion: they would overshoot.
constexpr double kMaxTurnRate = 3.0;  // rad/s
constexpr double kMaxSpeed = 0.8;     // m/s

Eigen::Vector3d Turn(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
  return LogSO3((to * from.conjugate()).toRotationMatrix());
}

Eigen::Vector3d Limited(const Eigen::Vector3d& v, double limit) {
  const double norm = v.norm();
  return norm > limit ? Eigen::Vector3d(v * (limit / norm)) : v;
}

}  // namespace

MotionBlend::MotionBlend(const BodyFrame& old_before, const BodyFrame& old_now,
                         const BodyFrame& new_before, const BodyFrame& new_now, double frame_rate,
                         double duration_s)
    : duration_s_(duration_s) {
  for (int j = 0; j < kNumBodyJoints; ++j) {
    offset_.col(j) = Turn(new_now.local[j], old_now.local[j]);
    const Eigen::Vector3d before = Turn(new_before.local[j], old_before.local[j]);
    velocity_.col(j) = Limited(frame_rate * (offset_.col(j) - before), kMaxTurnRate);
  }
  offset_.col(kNumBodyJoints) = old_now.pelvis - new_now.pelvis;
  const Eigen::Vector3d before = old_before.pelvis - new_before.pelvis;
  velocity_.col(kNumBodyJoints) =
      Limited(frame_rate * (offset_.col(kNumBodyJoints) - before), kMaxSpeed);
}

BodyFrame MotionBlend::Apply(const BodyFrame& frame, double time_s) const {
  if (time_s >= duration_s_) return frame;
  const double s = std::max(time_s, 0.0) / duration_s_;
  const double s3 = s * s * s;
  // Quintic Hermite polynomials of the starting value and the starting velocity.
  const double value = 1.0 + s3 * (-10.0 + s * (15.0 - 6.0 * s));
  const double slope = s + s3 * (-6.0 + s * (8.0 - 3.0 * s));
  const Offsets left = value * offset_ + slope * duration_s_ * velocity_;
  BodyFrame blended = frame;
  for (int j = 0; j < kNumBodyJoints; ++j) {
    blended.local[j] = (Eigen::Quaterniond(ExpSO3(left.col(j))) * frame.local[j]).normalized();
  }
  blended.pelvis += left.col(kNumBodyJoints);
  return blended;
}

}  // namespace holdfast
