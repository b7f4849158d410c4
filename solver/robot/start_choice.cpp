// SPDX-License-Identifier: MIT
#include "solver/robot/start_choice.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "solver/robot/robot_hold.h"

namespace holdfast {

int ChooseStart(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                const std::vector<double>& costs) {
  constexpr double kMostCost = 3.0;  // over the least
  constexpr double kGive_m = 0.02;   // for which twice the cost is paid
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return costs[k]; });
  const RobotHold hold(setup);
  PosedRobot posed(setup.robot);
  std::size_t best = order.front();
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t k : order) {
    if (costs[k] > kMostCost * costs[order.front()] || costs[k] >= least) break;
    posed.Set(poses[k]);
    const double cost = costs[k] * (1.0 + hold.Give_m(posed) / kGive_m);
    if (cost >= least) continue;
    least = cost;
    best = k;
  }
  return static_cast<int>(best);
}

}  // namespace holdfast
