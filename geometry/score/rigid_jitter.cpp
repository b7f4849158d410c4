// SPDX-License-Identifier: MIT
#include "geometry/score/rigid_jitter.h"

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kStill = 1e-3;  // m/s^2 or rad/s^2

// Mean norm of difference(t) over the t in [before, frames - after) whose frames are all included.
template <typename Difference>
std::optional<double> MeanNorm(int frames, int before, int after,
                               std::span<const std::uint8_t> counts, const Difference& difference) {
  double sum = 0.0;
  int number = 0;
  for (int t = before; t < frames - after; ++t) {
    bool all = true;
    for (int s = t - before; s <= t + after && !counts.empty(); ++s) all = all && counts[s] != 0;
    if (!all) continue;
    sum += difference(t).norm();
    ++number;
  }
  return number > 0 ? std::optional(sum / number) : std::nullopt;
}

std::optional<double> Ratio(const std::optional<double>& object,
                            const std::optional<double>& follower, double still) {
  if (!object || !follower || *follower < still) return std::nullopt;
  return *object / *follower;
}

}  // namespace

Unevenness MeasureUnevenness(std::span<const Eigen::Isometry3d> world_from_body,
                             const Eigen::Vector3d& point_in_body, double frame_rate_hz,
                             std::span<const std::uint8_t> counts) {
  if (!(frame_rate_hz > 0.0)) throw Error("frame rate", "is not positive", "Give one in Hz");
  if (!counts.empty() && counts.size() != world_from_body.size()) {
    throw Error("motion", "has a different number of frames than there are frame flags",
                "Give one flag per frame, or none");
  }
  const double r = frame_rate_hz;
  const int frames = static_cast<int>(world_from_body.size());
  const auto x = [&](int t) -> Eigen::Vector3d { return world_from_body[t] * point_in_body; };
  const auto w = [&](int t) -> Eigen::Vector3d {
    return r * LogSO3(world_from_body[t + 1].linear() * world_from_body[t].linear().transpose());
  };
  using Vector = Eigen::Vector3d;
  Unevenness result;
  result.acceleration_m_s2 = MeanNorm(frames, 1, 1, counts, [&](int t) -> Vector {
    return r * r * (x(t + 1) - 2.0 * x(t) + x(t - 1));
  });
  result.jerk_m_s3 = MeanNorm(frames, 2, 2, counts, [&](int t) -> Vector {
    return 0.5 * r * r * r * (x(t + 2) - 2.0 * x(t + 1) + 2.0 * x(t - 1) - x(t - 2));
  });
  result.angular_acceleration_rad_s2 =
      MeanNorm(frames, 1, 1, counts, [&](int t) -> Vector { return r * (w(t) - w(t - 1)); });
  result.angular_jerk_rad_s3 = MeanNorm(frames, 1, 2, counts, [&](int t) -> Vector {
    return r * r * (w(t + 1) - 2.0 * w(t) + w(t - 1));
  });
  return result;
}

CarryJitter MeasureCarryJitter(std::span<const Eigen::Isometry3d> world_from_wrist,
                               std::span<const Eigen::Isometry3d> world_from_object,
                               const Eigen::Vector3d& center_in_object, double frame_rate_hz,
                               std::span<const std::uint8_t> counts) {
  if (world_from_wrist.size() != world_from_object.size()) {
    throw Error("motion", "wrist and object have different numbers of frames",
                "Give one pose of each per frame");
  }
  CarryJitter jitter;
  jitter.object = MeasureUnevenness(world_from_object, center_in_object, frame_rate_hz, counts);
  jitter.wrist =
      MeasureUnevenness(world_from_wrist, Eigen::Vector3d::Zero(), frame_rate_hz, counts);
  Eigen::Vector3d center_in_wrist = Eigen::Vector3d::Zero();
  int number = 0;
  for (std::size_t t = 0; t < world_from_wrist.size(); ++t) {
    if (!counts.empty() && !counts[t]) continue;
    center_in_wrist += world_from_wrist[t].inverse() * (world_from_object[t] * center_in_object);
    ++number;
  }
  if (number > 0) center_in_wrist /= number;
  jitter.follower = MeasureUnevenness(world_from_wrist, center_in_wrist, frame_rate_hz, counts);
  const Unevenness& o = jitter.object;
  const Unevenness& f = jitter.follower;
  const double still_jerk = kStill * frame_rate_hz;
  jitter.acceleration_ratio = Ratio(o.acceleration_m_s2, f.acceleration_m_s2, kStill);
  jitter.jerk_ratio = Ratio(o.jerk_m_s3, f.jerk_m_s3, still_jerk);
  jitter.angular_acceleration_ratio =
      Ratio(o.angular_acceleration_rad_s2, f.angular_acceleration_rad_s2, kStill);
  jitter.angular_jerk_ratio = Ratio(o.angular_jerk_rad_s3, f.angular_jerk_rad_s3, still_jerk);
  return jitter;
}

}  // namespace holdfast
