// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/balance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast {
namespace {

using Eigen::Vector2d;

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

bool IsInTriangle(const Vector2d& p, const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const double u = Cross(b - a, p - a), v = Cross(c - b, p - b), w = Cross(a - c, p - c);
  return (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
}

Vector2d NearestOnSegment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const double length = (b - a).squaredNorm();
  if (length < 1e-12) return a;
  return a + std::clamp((p - a).dot(b - a) / length, 0.0, 1.0) * (b - a);
}

}  // namespace

Eigen::Vector3d CenterOfMass(const BodyPlacement& placed) {
  return placed.joints *
         Eigen::Map<const Eigen::Vector<double, kNumBodyJoints>>(kJointMasses.data());
}

FootSupport::FootSupport(const Soles& soles) {
  constexpr double kOnGround_m = 0.04;
  const double lowest = soles.row(2).minCoeff();
  for (const auto& sole : soles.colwise()) {
    if (sole.z() <= lowest + kOnGround_m) points_.push_back(sole.head<2>());
  }
}

// Of at most four points: in a triangle of theirs, or nearest to the segment between two.
Vector2d FootSupport::Nearest(const Vector2d& point) const {
  const std::size_t n = points_.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      for (std::size_t k = j + 1; k < n; ++k) {
        if (IsInTriangle(point, points_[i], points_[j], points_[k])) return point;
      }
    }
  }
  Vector2d nearest = points_.front();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      const Vector2d on = NearestOnSegment(point, points_[i], points_[j]);
      if ((on - point).norm() < (nearest - point).norm()) nearest = on;
    }
  }
  return nearest;
}

double FootSupport::Outside(const Vector2d& point) const {
  return std::max(0.0, (point - Nearest(point)).norm() - kFootRadius_m);
}

std::vector<bool> StandsStill(std::span<const BodyFrame> frames, double frame_rate) {
  constexpr double kStill_m_s = 0.1, kAround_s = 1.0 / 3.0;
  const auto count = static_cast<int>(frames.size());
  const int around = std::max(1, static_cast<int>(std::lround(kAround_s * frame_rate)));
  std::vector<bool> still(frames.size(), true);
  for (int t = 0; t < count; ++t) {
    const int from = std::max(0, t - around), to = std::min(count - 1, t + around);
    const double way = (frames[to].pelvis - frames[from].pelvis).head<2>().norm();
    still[t] = way * frame_rate <= kStill_m_s * (to - from);
  }
  return still;
}

std::vector<double> OffBalance(std::span<const BodyFrame> frames,
                               const Eigen::Matrix3Xd& rest_joints, double sole_y,
                               double frame_rate) {
  constexpr double kStands = 0.6;
  const SolePoints probe(rest_joints, sole_y);
  const std::vector<bool> still = StandsStill(frames, frame_rate);
  std::vector<double> off(frames.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t t = 0; t < frames.size(); ++t) {
    if (!still[t]) continue;
    const BodyPlacement placed = Place(rest_joints, frames[t]);
    const Soles soles = probe.At(placed);
    const double height = frames[t].pelvis.z() - soles.row(2).minCoeff();
    if (height < kStands * (rest_joints(1, kPelvis) - sole_y)) continue;
    off[t] = FootSupport(soles).Outside(CenterOfMass(placed).head<2>());
  }
  return off;
}

}  // namespace holdfast
