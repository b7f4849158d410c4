// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

namespace holdfast {

/// How a way is spread over the time until arrival: until 95 % of it is made. What comes after, a
/// person who stands and reaches, is not looked at.
struct WayPace {
  int arrival = 0;            ///< frames until then; 0 when no way is made: all else is NaN then
  double half_way_ratio = 0;  ///< time to half of the way, over time to arrival: 0.5 is even
  double fastest_fifth_ratio =
      0;                    ///< of the way, made in the fastest fifth of the time: 0.2 is even
  Eigen::VectorXd profile;  ///< mean speed in equal parts of the time
};

/// `speeds`: one per frame, m/s along the ground; those below 0.1 m/s, a sway, make no way.
WayPace MeasurePace(std::span<const double> speeds, int profile_points);

}  // namespace holdfast
