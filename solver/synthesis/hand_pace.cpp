// SPDX-License-Identifier: MIT
#include "solver/synthesis/hand_pace.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "generator/scripted/minimum_jerk.h"
#include "generator/walk_statistics/hand_way.h"
#include "geometry/clip/resample.h"

namespace holdfast {
namespace {

constexpr double kAtRest = 0.04;        // of the greatest speed
constexpr double kComesToRest_s = 0.6;  // after arrival, at most
// The share of time that passes as it did: what is still for the hand is not left out.
constexpr double kAsItWas = 0.3;
constexpr double kEarly = 0.7;  // minimum jerk at time^kEarly is fastest at 0.37 of the time

// Frames from where the hand is at rest to where it is at rest again.
struct Stretch {
  Eigen::Index begin = 0, end = 0;
};

Stretch StretchOf(const HandWay& way, const Eigen::VectorXd& steps, double rate) {
  const double at_rest = kAtRest * way.peak_m_s / rate;
  Stretch stretch{way.begin, way.arrival};
  while (stretch.begin > 0 && steps[stretch.begin - 1] > at_rest &&
         steps[stretch.begin - 1] <= steps[stretch.begin]) {
    --stretch.begin;
  }
  const auto last =
      std::min<Eigen::Index>(steps.size() - 1, way.arrival + std::lround(kComesToRest_s * rate));
  while (stretch.end < last && steps[stretch.end] > at_rest &&
         steps[stretch.end] <= steps[stretch.end - 1]) {
    ++stretch.end;
  }
  return stretch;
}

}  // namespace

void PaceHand(const Eigen::Matrix3Xd& rest_joints, Clip& clip) {
  const std::vector<BodyFrame> body = BodyFrames(clip, rest_joints);
  const Eigen::Matrix3Xd path = HandPath(body, Place(rest_joints, body), Side::kRight);
  const HandWay way = MeasureHandWay(path, clip.frame_rate, 1);
  if (!(way.length_m > 0.0) || way.arrival - way.begin < 4) return;
  const Eigen::Index frames = path.cols();
  const Eigen::VectorXd steps =
      (path.rightCols(frames - 1) - path.leftCols(frames - 1)).colwise().norm().transpose();
  const auto [begin, end] = StretchOf(way, steps, clip.frame_rate);
  const auto count = static_cast<double>(end - begin);
  const double length = steps.segment(begin, end - begin).sum();

  // Shares of way and time together grow in every frame: what is shown when they are as they
  // should be.
  std::vector<double> at;
  for (Eigen::Index t = 0; t < frames; ++t) at.push_back(static_cast<double>(t));
  Eigen::Index k = begin;
  double made = 0.0;  // at frame k
  for (Eigen::Index t = begin; t < end; ++t) {
    const double time = static_cast<double>(t - begin) / count;
    const double wanted = (1.0 - kAsItWas) * MinimumJerk(std::pow(time, kEarly)) + kAsItWas * time;
    const auto step = [&] { return (1.0 - kAsItWas) * steps[k] / length + kAsItWas / count; };
    while (k + 1 < end && made + step() < wanted) made += step(), ++k;
    at[static_cast<std::size_t>(t)] =
        static_cast<double>(k) + std::clamp((wanted - made) / step(), 0.0, 1.0);
  }
  clip = ResampleAt(clip, at);
}

}  // namespace holdfast
