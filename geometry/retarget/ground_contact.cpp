// SPDX-License-Identifier: MIT
#include "geometry/retarget/ground_contact.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace holdfast {
namespace {

constexpr double kStillSpeed = 0.3;    // m/s: a planted sole rolls without sliding
constexpr double kLevelHeight = 0.03;  // m: variation between soles of a standing person
constexpr double kMaxSlope = 0.05;     // steeper is a ramp, not a tilted capture volume

double Percentile(std::vector<double>& values, double share) {
  const auto middle =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Points at rest: of each foot the lower of heel and ball. Other parts only if they are lowest of
// all, since a hanging hand is not in contact.
std::vector<Eigen::Vector3d> StillPoints(const std::vector<Eigen::Matrix3Xd>& points,
                                         double frame_rate) {
  std::vector<Eigen::Vector3d> still;
  const std::size_t frames = points.size();
  for (std::size_t t = 0; t < frames; ++t) {
    const double lowest = points[t].row(2).minCoeff();
    const std::size_t before = t > 0 ? t - 1 : 0, after = std::min(t + 1, frames - 1);
    const double span = static_cast<double>(std::max<std::size_t>(after - before, 1)) / frame_rate;
    for (Eigen::Index i = 0; i < points[t].cols(); ++i) {
      const bool sole = i < GroundProbe::kNumSoles;
      // Angles too large for a double's square turn a joint into NaN.
      if (!points[t].col(i).allFinite()) continue;
      if (points[t](2, i) > (sole ? points[t](2, i ^ 1) : lowest)) continue;
      const double speed = (points[after].col(i) - points[before].col(i)).norm() / span;
      if (speed < kStillSpeed) still.push_back(points[t].col(i));
    }
  }
  return still;
}

double LowestLevel(const std::vector<Eigen::Vector3d>& still) {
  std::vector<double> height;
  for (const auto& point : still) height.push_back(point.z());
  std::sort(height.begin(), height.end());
  // The lowest window of kLevelHeight with at least a quarter of the points of the fullest one ...
  std::vector<std::size_t> count(height.size());
  std::size_t end = 0, most = 0;
  for (std::size_t begin = 0; begin < height.size(); ++begin) {
    while (end < height.size() && height[end] <= height[begin] + kLevelHeight) ++end;
    count[begin] = end - begin;
    most = std::max(most, count[begin]);
  }
  std::size_t begin = 0;
  while (4 * count[begin] < most) ++begin;
  // ... then the fullest above it, since the window may only touch the level from below.
  std::size_t best = begin;
  for (std::size_t i = begin; i < height.size() && height[i] <= height[begin] + kLevelHeight; ++i) {
    if (count[i] > count[best]) best = i;
  }
  return height[best + count[best] / 2];
}

// Reweighted least squares for a plane, initialized level. Slopes along directions of little spread
// are regularized to zero. Kept only if it improves the fit.
void TiltToFit(const std::vector<Eigen::Vector3d>& still, GroundPlane& ground) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& point : still) middle += point;
  middle /= static_cast<double>(still.size());
  Eigen::Vector3d plane(ground.height, 0, 0);  // height at `middle`, slopes
  constexpr double kRidge = 0.15;              // m: spread at which a slope is shrunk by half
  double width = 0.06;
  for (int iteration = 0; iteration < 12; ++iteration, width = std::max(0.8 * width, 0.015)) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double total = 0;
    for (const auto& point : still) {
      const Eigen::Vector3d row(1, point.x() - middle.x(), point.y() - middle.y());
      const double off = (point.z() - row.dot(plane)) / width;
      const double weight = 1 / ((1 + off * off) * (1 + off * off));  // Geman-McClure
      normal += weight * row * row.transpose();
      right += weight * point.z() * row;
      total += weight;
    }
    normal(1, 1) += total * kRidge * kRidge;
    normal(2, 2) += total * kRidge * kRidge;
    plane = normal.ldlt().solve(right);
  }
  const auto mean_cost = [&](double height, const Eigen::Vector2d& slope) {
    double cost = 0;
    for (const auto& point : still) {
      const double off =
          (point.z() - height - slope.dot(point.head<2>() - middle.head<2>())) / 0.015;
      cost += off * off / (1 + off * off);
    }
    return cost / static_cast<double>(still.size());
  };
  const Eigen::Vector2d slope = plane.tail<2>();
  if (!plane.allFinite() || slope.norm() > kMaxSlope ||
      mean_cost(plane(0), slope) > 0.8 * mean_cost(ground.height, Eigen::Vector2d::Zero())) {
    return;
  }
  ground.slope = slope;
  ground.height = plane(0) - slope.dot(middle.head<2>());
}

}  // namespace

GroundProbe::GroundProbe(const Eigen::Matrix3Xd& rest_joints, double floor_y) {
  for (const int ankle : {7, 8}) {
    const int foot = ankle + 3;
    const Eigen::Vector3d along = rest_joints.col(foot) - rest_joints.col(ankle);
    // The heel extends about a third of the ankle-to-ball length behind the ankle.
    points_.push_back(
        {ankle, Eigen::Vector3d(-along.x() / 3, floor_y - rest_joints(1, ankle), -along.z() / 3),
         0.0});
    points_.push_back({foot, Eigen::Vector3d(0, floor_y - rest_joints(1, foot), 0), 0.0});
  }
  // Thickness of flesh under a joint, meters: approximate, from an adult's cross-sections.
  for (const auto& [joint, radius] : {std::pair{0, 0.10},
                                      {4, 0.055},
                                      {5, 0.055},
                                      {15, 0.09},
                                      {18, 0.045},
                                      {19, 0.045},
                                      {20, 0.03},
                                      {21, 0.03}}) {
    points_.push_back({joint, Eigen::Vector3d::Zero(), radius});
  }
}

Eigen::Matrix3Xd GroundProbe::LowestPoints(
    const Eigen::Matrix<double, 3, kNumJoints>& joints,
    const std::array<Eigen::Matrix3d, kNumJoints>& rotations) const {
  Eigen::Matrix3Xd lowest(3, points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Point& point = points_[i];
    lowest.col(i) = joints.col(point.joint) + rotations[point.joint] * point.offset;
    lowest(2, i) -= point.radius;
  }
  return lowest;
}

GroundPlane FindGround(const std::vector<Eigen::Matrix3Xd>& points, double frame_rate, bool level) {
  const std::vector<Eigen::Vector3d> still = StillPoints(points, frame_rate);
  GroundPlane ground;
  if (still.size() < 3) {
    std::vector<double> lowest;
    for (const auto& frame : points) {
      if (frame.allFinite()) lowest.push_back(frame.row(2).minCoeff());
    }
    ground.height = lowest.empty() ? 0 : Percentile(lowest, 0.05);
    return ground;
  }
  ground.height = LowestLevel(still);
  if (level) TiltToFit(still, ground);
  return ground;
}

}  // namespace holdfast
