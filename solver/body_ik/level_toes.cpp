// SPDX-License-Identifier: MIT
#include "solver/body_ik/level_toes.h"

#include <algorithm>
#include <cmath>

#include "generator/body/limb_ik.h"
#include "generator/scripted/minimum_jerk.h"

namespace holdfast {

void LevelToes(const Eigen::Matrix3Xd& rest_joints, const SolePoints& soles, double share,
               BodyFrame& frame) {
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
    frame.local[joint] =
        (frame.local[joint] *
         Eigen::Quaterniond(Eigen::AngleAxisd(-near * down, Eigen::Vector3d::UnitX())))
            .normalized();
  }
}

}  // namespace holdfast
