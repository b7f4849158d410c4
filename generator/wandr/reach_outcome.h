// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "generator/wandr/run_rollouts.h"
#include "geometry/body/skeleton.h"

namespace holdfast::wandr {

inline constexpr double kReachedWithin = 0.10;          ///< metres: a goal counts as reached
inline constexpr double kRestsWithin = 0.02;            ///< metres: a wrist stays
inline constexpr double kSkatingPerFrame = 0.02 / 3.0;  ///< metres per frame (2/3 cm)
inline constexpr double kAirborneAnkleOrBall = 0.12;    ///< metres above the floor

/// How one motion did on its way to one goal. Frames count from 0, the start.
struct ReachOutcome {
  double closest_m = 0.0;  ///< least distance of wrist and goal
  int closest_frame = 0;   ///< the first frame that has it
  double last_m = 0.0;     ///< distance in the last frame
  double rest_m = 0.0;     ///< greatest distance in the last half second
  int reached_frame = -1;  ///< first frame within kReachedWithin, -1 for none
  /// m/s, the wrist's way into reached_frame (out of it when that is the start); NaN for none.
  double speed_at_reach_m_s = 0.0;
  /// Share of pairs of frames in which the lowest of the ankles and balls of the feet (joints 7, 8,
  /// 10, 11) moves horizontally by more than kSkatingPerFrame.
  double skating_share = 0.0;
  double airborne_share = 0.0;          ///< frames whose lowest foot joint is above 12 cm
  double peak_pelvis_m_s = 0.0;         ///< greatest speed of the pelvis
  double mean_acceleration_m_s2 = 0.0;  ///< of the 22 joints, second differences
  /// The motion stopped being numbers; all of the above is of the frames before.
  bool diverged = false;

  bool Reached() const { return reached_frame >= 0; }
  bool Rests() const { return !diverged && rest_m <= kRestsWithin; }
  bool ReachedAtEnd() const { return !diverged && last_m <= kReachedWithin; }
};

/// `joints` (66 x F) as in RolloutTrack, floor z = 0. Throws Error for no frames and a goal that is
/// not finite.
ReachOutcome MeasureReach(const Eigen::Ref<const Eigen::MatrixXf>& joints,
                          const Eigen::Vector3d& goal, Side wrist = Side::kRight);

/// Over many motions. Shares in [0, 1], distances in metres.
struct ReachSummary {
  int count = 0;
  double success = 0.0;          ///< SR: within 10 cm in any frame
  double success_at_end = 0.0;   ///< within 10 cm in the last
  double rests = 0.0;            ///< within 2 cm in all of the last half second
  double distance_mean_m = 0.0;  ///< DTG: mean of closest_m
  double distance_median_m = 0.0;
  double skating = 0.0;   ///< mean of skating_share
  double airborne = 0.0;  ///< mean of airborne_share
  double peak_pelvis_median_m_s = 0.0;
  double acceleration_m_s2 = 0.0;   ///< mean of means
  double speed_at_reach_m_s = 0.0;  ///< mean of those that reach; NaN for none
  int diverged = 0;
};

/// Throws Error for none.
ReachSummary Summarise(std::span<const ReachOutcome> outcomes);

}  // namespace holdfast::wandr
