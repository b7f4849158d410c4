// SPDX-License-Identifier: MIT
#include "meshes/make/body/body_shape.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace holdfast {

using Eigen::Vector3d;

BodyShape::BodyShape()
    : trunk_(MakeTrunk()),
      head_(MakeHead()),
      arm_(MakeLeftArm()),
      leg_(MakeLeftLeg()),
      hand_(MakeLeftHand()) {}

double BodyShape::operator()(const Vector3d& point) const {
  const Vector3d p(std::abs(point.x()), point.y(), point.z());
  const double arm = SmoothUnion(arm_(p), hand_(p), 0.008);
  double value = SmoothUnion(trunk_(p), head_(p), 0.030);
  value = SmoothUnion(value, arm, 0.055);
  return SmoothUnion(value, leg_(p), 0.045);
}

Vector3d BodyShape::Gradient(const Vector3d& point) const {
  constexpr double kStep = 2e-5;
  Vector3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = kStep * Vector3d::Unit(axis);
    gradient[axis] = ((*this)(point + step) - (*this)(point - step)) / (2 * kStep);
  }
  return gradient;
}

Vector3d BodyShape::Project(const Vector3d& point, bool on_midline) const {
  constexpr int kNewtonSteps = 4;
  constexpr double kLongestStep = 0.01;
  Vector3d p = point;
  if (on_midline) p.x() = 0;
  for (int step = 0; step < kNewtonSteps; ++step) {
    const double value = (*this)(p);
    if (std::abs(value) < 1e-8) break;
    Vector3d gradient = Gradient(p);
    if (on_midline) gradient.x() = 0;
    const double norm2 = gradient.squaredNorm();
    if (norm2 < 1e-6) break;
    Vector3d move = -value / norm2 * gradient;
    if (move.norm() > kLongestStep) move *= kLongestStep / move.norm();
    p += move;
  }
  return p;
}

double TargetEdgeLength(const Vector3d& point) {
  const double x = std::abs(point.x());
  const double y = point.y();
  const double z = point.z();
  const auto ramp = [](double value, double from, double to) {
    const double t = std::clamp((value - from) / (to - from), 0.0, 1.0);
    return t * t * (3 - 2 * t);
  };
  const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
  static const std::array<Vector3d, kNumFingers> kLeftFingertips = [] {
    std::array<Vector3d, kNumFingers> tips;
    for (int f = 0; f < kNumFingers; ++f)
      tips[f] = LeftFingerChain(static_cast<Finger>(f)).points[3];
    return tips;
  }();
  constexpr double kBody = 0.0165, kHead = 0.0100, kFace = 0.0064, kFoot = 0.0105, kElbow = 0.0120,
                   kPalm = 0.0092, kFinger = 0.0058, kFingertip = 0.0047;
  double length = kBody;
  // Head and face, with the neck as transition.
  length = mix(length, kHead, ramp(y, 0.48, 0.58));
  if (y > 0.55) {
    const double front = ramp(z, 0.06, 0.095) * ramp(y, 0.555, 0.575) * ramp(y, 0.745, 0.715);
    const double ear = ramp(x, 0.055, 0.068) * ramp(std::abs(y - 0.668), 0.055, 0.035);
    length = mix(length, kFace, std::max(front, ear));
  }
  // Feet.
  length = mix(length, kFoot, ramp(y, -0.72, -0.82));
  // Knees and elbows bend: a little finer.
  length = std::min(length, mix(kElbow, kBody, ramp(std::abs(x - 0.41), 0.04, 0.10)));
  if (x > 0.3) length = std::min(length, mix(kBody, kElbow, ramp(x, 0.45, 0.58)));
  length = std::min(length, mix(0.0135, kBody, ramp(std::abs(y + 0.408), 0.05, 0.12)));
  // Hands.
  if (x > 0.55) {
    length = mix(length, kPalm, ramp(x, 0.58, 0.67));
    const double finger =
        std::max(ramp(x, 0.715, 0.740), ramp(z, 0.030, 0.050) * ramp(x, 0.66, 0.68));
    length = mix(length, kFinger, finger);
    for (int f = 0; f < kNumFingers; ++f) {
      const Vector3d& tip = kLeftFingertips[f];
      length = mix(length, kFingertip, ramp((Vector3d(x, y, z) - tip).norm(), 0.020, 0.012));
    }
  }
  return length;
}

}  // namespace holdfast
