// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/hand_way.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace holdfast {
namespace {

constexpr double kNoWay = std::numeric_limits<double>::quiet_NaN();
constexpr double kLeast_m = 0.05;
constexpr double kThere = 0.95;  // fraction of the farthest distance
constexpr double kSlow = 0.1;    // fraction of the peak speed

// Counts rises by kSlow that are followed by falls. Speeds are relative to the peak.
int Submovements(const Eigen::VectorXd& speeds) {
  int count = 0;
  double low = 0.0, high = 0.0;
  bool rises = false;
  for (const double speed : speeds) {
    if (rises) {
      high = std::max(high, speed);
      if (speed > high - kSlow) continue;
      rises = false;
      low = speed;
    } else {
      low = std::min(low, speed);
      if (speed < low + kSlow) continue;
      rises = true;
      high = speed;
      ++count;
    }
  }
  return count;
}

}  // namespace

Eigen::Matrix3Xd HandPath(std::span<const BodyFrame> frames, std::span<const BodyPlacement> placed,
                          Side side) {
  Eigen::Matrix3Xd path(3, std::ssize(frames));
  for (Eigen::Index t = 0; t < path.cols(); ++t) {
    const auto at = static_cast<std::size_t>(t);
    const Eigen::AngleAxisd to_heading(-Yaw(frames[at]), Eigen::Vector3d::UnitZ());
    const auto& joints = placed[at].joints;
    path.col(t) = to_heading * (joints.col(WristJoint(side)) - joints.col(kPelvis));
  }
  return path;
}

HandWay MeasureHandWay(const Eigen::Matrix3Xd& path, double rate, int profile_points) {
  HandWay way{0, 0, kNoWay, kNoWay, kNoWay, kNoWay, kNoWay, kNoWay, {}};
  const Eigen::Index frames = path.cols();
  if (frames < 3) return way;
  const Eigen::VectorXd gone = (path.colwise() - path.col(0)).colwise().norm().transpose();
  if (gone.maxCoeff() < kLeast_m) return way;
  Eigen::VectorXd speeds = Eigen::VectorXd::Zero(frames);
  for (Eigen::Index t = 1; t + 1 < frames; ++t)
    speeds[t] = 0.5 * rate * (path.col(t + 1) - path.col(t - 1)).norm();

  Eigen::Index arrival = 0, peak = 0;
  while (gone[arrival] < kThere * gone.maxCoeff()) ++arrival;
  way.peak_m_s = speeds.head(arrival + 1).maxCoeff(&peak);
  Eigen::Index begin = peak;
  while (begin > 0 && speeds[begin] > kSlow * way.peak_m_s) --begin;
  way.begin = static_cast<int>(begin);
  way.arrival = static_cast<int>(arrival);

  const Eigen::Index steps = arrival - begin;
  way.seconds = static_cast<double>(steps) / rate;
  way.length_m = (path.col(arrival) - path.col(begin)).norm();
  way.time_to_peak_ratio = static_cast<double>(peak - begin) / static_cast<double>(steps);
  double made = 0.0;
  for (Eigen::Index t = begin; t < arrival; ++t) made += (path.col(t + 1) - path.col(t)).norm();
  way.straightness_ratio = way.length_m / made;
  const Eigen::VectorXd of_way = speeds.segment(begin, steps + 1) / way.peak_m_s;
  way.submovements = Submovements(of_way);

  // Speeds are interpolated linearly between frames.
  way.profile.resize(profile_points);
  for (int i = 0; i < profile_points; ++i) {
    const double at = (i + 0.5) / profile_points * static_cast<double>(steps);
    const auto t = std::min(static_cast<Eigen::Index>(at), steps - 1);
    const double share = at - static_cast<double>(t);
    way.profile[i] = (1.0 - share) * of_way[t] + share * of_way[t + 1];
  }
  return way;
}

}  // namespace holdfast
