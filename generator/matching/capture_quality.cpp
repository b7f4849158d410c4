// SPDX-License-Identifier: MIT
#include "generator/matching/capture_quality.h"
#include "geometry/rotation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace holdfast {
namespace {

constexpr double kRate = 30.0;
constexpr double kSkate = 0.02 / 3.0;              // meters per frame
constexpr double kStill = 0.15;                    // m/s
constexpr double kAirborne = 0.10;                 // meters
constexpr double kAlwaysAllowed = 17.0 * kDegree;  // for joints that captures hardly use

double Percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

std::size_t AccelerationBin(double value) {
  std::size_t bin = 0;
  for (double edge = 1.0; value >= edge && bin + 1 < AccelerationHistogram().size(); edge *= 2.0) {
    ++bin;
  }
  return bin;
}

}  // namespace

void MotionStatistics::Add(const MotionStatistics& other) {
  frames += other.frames;
  skating_frames += other.skating_frames;
  for (std::size_t k = 0; k < pelvis_speed.size(); ++k) pelvis_speed[k] += other.pelvis_speed[k];
  for (std::size_t k = 0; k < acceleration.size(); ++k) acceleration[k] += other.acceleration[k];
}

MotionQuality MeasureQuality(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles,
                             std::span<const BodyFrame> frames, const JointLimits& limits,
                             MotionStatistics* statistics) {
  MotionQuality quality;
  quality.frames = static_cast<int>(frames.size());
  MotionStatistics sums;
  sums.frames = quality.frames;
  const std::vector<BodyPlacement> placed = Place(rest_joints, frames);
  const std::vector<Soles> points = soles.At(placed);
  int beyond = 0, airborne = 0;
  for (const BodyFrame& frame : frames) {
    for (int j = 1; j < kNumBodyJoints; ++j) {
      const double angle = frame.local[j].angularDistance(Eigen::Quaterniond::Identity());
      beyond += angle > limits[j] ? 1 : 0;
    }
  }
  std::vector<double> lowest, still, accelerations;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    Eigen::Index point = 0;
    const double height = points[t].row(2).minCoeff(&point);
    lowest.push_back(height);
    airborne += height > kAirborne ? 1 : 0;
    if (t + 1 < frames.size()) {
      const double way = (points[t + 1].col(point) - points[t].col(point)).head<2>().norm();
      sums.skating_frames += way > kSkate ? 1.0 : 0.0;
      if ((points[t + 1].col(point) - points[t].col(point)).norm() * kRate < kStill) {
        still.push_back(height);
      }
      const double speed = (frames[t + 1].pelvis - frames[t].pelvis).head<2>().norm() * kRate;
      ++sums.pelvis_speed[std::min(static_cast<std::size_t>(speed / 0.1),
                                   sums.pelvis_speed.size() - 1)];
    }
    if (t == 0 || t + 1 >= frames.size()) continue;
    const Eigen::Matrix<double, 3, kNumBodyJoints> second =
        placed[t + 1].joints - 2.0 * placed[t].joints + placed[t - 1].joints;
    for (int j = 0; j < kNumBodyJoints; ++j) {
      const double a = second.col(j).norm() * kRate * kRate;
      accelerations.push_back(a);
      quality.mean_acceleration += a;
      quality.max_acceleration = std::max(quality.max_acceleration, a);
      ++sums.acceleration[AccelerationBin(a)];
    }
  }
  const auto share = [&](double count, double of) { return of > 0.0 ? count / of : 0.0; };
  const double count = quality.frames;
  quality.skate_ratio = share(sums.skating_frames, count - 1.0);
  quality.airborne_ratio = share(airborne, count);
  quality.beyond_limits_ratio = share(beyond, count * (kNumBodyJoints - 1));
  quality.mean_acceleration =
      share(quality.mean_acceleration, static_cast<double>(accelerations.size()));
  quality.p99_acceleration = Percentile(std::move(accelerations), 0.99);
  quality.lowest_sole_m = Percentile(lowest, 0.01);
  quality.still_sole_m = Percentile(std::move(still), 0.95);
  if (statistics != nullptr) statistics->Add(sums);
  return quality;
}

JointLimits LimitsOf(const std::vector<std::vector<BodyFrame>>& motions) {
  JointLimits limits;
  limits.fill(std::numbers::pi);
  for (int j = 1; j < kNumBodyJoints; ++j) {
    std::vector<double> angles;
    for (const auto& motion : motions) {
      for (const BodyFrame& frame : motion) {
        angles.push_back(frame.local[j].angularDistance(Eigen::Quaterniond::Identity()));
      }
    }
    limits[j] = std::max(Percentile(std::move(angles), 0.999), kAlwaysAllowed) + 3.0 * kDegree;
  }
  return limits;
}

std::string FaultOf(const MotionQuality& quality) {
  if (quality.frames < 15) return "shorter than half a second";
  if (quality.airborne_ratio > 0.25) {
    return fmt::format("in the air in {:.0f} % of frames", 100.0 * quality.airborne_ratio);
  }
  if (quality.still_sole_m > 0.10) {
    return fmt::format("stands {:.0f} cm above the ground: the ground is not level",
                       100.0 * quality.still_sole_m);
  }
  if (quality.lowest_sole_m < -0.06) {
    return fmt::format("feet {:.0f} cm below the ground", -100.0 * quality.lowest_sole_m);
  }
  if (quality.skate_ratio > 0.6) {
    return fmt::format("feet slide in {:.0f} % of frames", 100.0 * quality.skate_ratio);
  }
  if (quality.max_acceleration > 250.0) {
    return fmt::format("a joint jumps ({:.0f} m/s^2)", quality.max_acceleration);
  }
  return {};
}

JointLimits CapturedJointLimits() {
  constexpr std::array<int, kNumBodyJoints> kDegrees = {180, 146, 133, 46,  161, 160, 64, 91,
                                                        112, 45,  65,  66,  67,  42,  54, 77,
                                                        126, 152, 156, 161, 100, 87};
  JointLimits limits;
  for (std::size_t k = 0; k < limits.size(); ++k)
    limits[k] = kDegrees[k] * std::numbers::pi / 180.0;
  return limits;
}

}  // namespace holdfast
