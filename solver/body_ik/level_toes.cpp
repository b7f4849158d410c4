// SPDX-License-Identifier: MIT
#include "solver/body_ik/level_toes.h"

#include <algorithm>
#include <cmath>

#include "generator/body/limb_ik.h"
#include "generator/scripted/minimum_jerk.h"

namespace holdfast {

void LevelToes(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles, double share,
               BodyFrame& frame, double most_rad) {
  constexpr double kAll = 0.03, kNothing = 0.10;  // metres of the ball above the ground
  const BodyPlacement placed = Place(rest_joints, frame);
  const Soles points = soles.At(placed);
  for (const int foot : {0, 1}) {
    const int joint = foot == 0 ? kLeftFoot : kRightFoot;
    const Eigen::Matrix3d& toes = placed.rotation[joint];
    const double down = -std::asin(std::clamp(toes(2, 2), -1.0, 1.0));  // of the rest frame's z
    const double near =
        share * MinimumJerk((kNothing - points(2, 2 * foot + 1)) / (kNothing - kAll));
    if (down <= 0.0 || near <= 0.0) continue;
    const Eigen::Quaterniond before = frame.local[joint];
    const auto bent = [&](double by) {
      const Eigen::Quaterniond up(Eigen::AngleAxisd(-by * near * down, Eigen::Vector3d::UnitX()));
      return (before * up).normalized();
    };
    const Eigen::Quaterniond rest = Eigen::Quaterniond::Identity();
    const double most = std::max(most_rad, before.angularDistance(rest));
    double by = 1.0;
    while (by > 0.01 && bent(by).angularDistance(rest) > most) by *= 0.95;
    frame.local[joint] = bent(by);
  }
}

}  // namespace holdfast
