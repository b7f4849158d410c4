// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace holdfast {

/// Where a wrist is in the frames next to those of a way; nothing beyond the ends of the clip.
struct WayEnds {
  std::optional<Eigen::Vector3d> two_before, before, after, two_after;
};

/// A way of a wrist with less acceleration: of all paths x the one that minimizes
///
///   sum_k |x_{k-1} - 2 x_k + x_{k+1}|^2 + sum_k w_k |x_k - way_k|^2,
///
/// where w_k begins at 1e-3 (the path follows the way over about six frames) and grows wherever
/// `is_clear(k, x_k)` says that the hand would be in something, until it is so nowhere.
/// `way` is 3 x K, one frame a column, clear by itself; where easing does not become clear, it
/// comes back as it is.
Eigen::Matrix3Xd EasedWay(const Eigen::Matrix3Xd& way, const WayEnds& ends,
                          const std::function<bool(int, const Eigen::Vector3d&)>& is_clear);

}  // namespace holdfast
