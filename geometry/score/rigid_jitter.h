// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Geometry>

namespace holdfast {

/// Jitter of a rigid motion: means over the frames where the finite difference exists. With x the
/// position of a point of the body, R its rotation and r the frame rate:
///   acceleration          r^2 |x_t+1 - 2 x_t + x_t-1|
///   jerk                  r^3 |x_t+2 - 2 x_t+1 + 2 x_t-1 - x_t-2| / 2
///   angular acceleration  r |w_t - w_t-1|,  w_t = r log(R_t+1 R_t^T)
///   angular jerk          r^2 |w_t+1 - 2 w_t + w_t-1|
/// None if no frame has a difference.
struct Unevenness {
  std::optional<double> acceleration_m_s2;
  std::optional<double> jerk_m_s3;
  std::optional<double> angular_acceleration_rad_s2;
  std::optional<double> angular_jerk_rad_s3;
};

/// Measures the body's point at `point_in_body` along the poses. `counts` (empty: all) flags the
/// frames to include; a difference needs all of its frames. Throws Error for unequal lengths and a
/// frame rate that is not positive.
Unevenness MeasureUnevenness(std::span<const Eigen::Isometry3d> world_from_body,
                             const Eigen::Vector3d& point_in_body, double frame_rate_hz,
                             std::span<const std::uint8_t> counts = {});

/// Jitter of an object relative to that of the hand that carries it.
struct CarryJitter {
  Unevenness object;    ///< at the object's center
  Unevenness wrist;     ///< at the wrist
  Unevenness follower;  ///< of a point fixed to the wrist, at the object center's mean position
  /// object / follower: exactly 1 for a rigidly carried object, at any distance from the wrist.
  /// None if the follower is still (below 1 mm/s^2 or 1 mrad/s^2, times the frame rate for jerk),
  /// where the ratio would be rounding noise.
  std::optional<double> acceleration_ratio, jerk_ratio;
  std::optional<double> angular_acceleration_ratio, angular_jerk_ratio;
};

/// `center_in_object` is in the object's coordinate frame. The mean position is over the included
/// frames. Throws Error as MeasureUnevenness.
CarryJitter MeasureCarryJitter(std::span<const Eigen::Isometry3d> world_from_wrist,
                               std::span<const Eigen::Isometry3d> world_from_object,
                               const Eigen::Vector3d& center_in_object, double frame_rate_hz,
                               std::span<const std::uint8_t> counts = {});

}  // namespace holdfast
