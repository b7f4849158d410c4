// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "solver/robot/near_samples.h"
#include "solver/robot/robot_solids.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

/// Links stay out of each other: as RobotPenetrationTerm, for points of one link in the other, over
/// the pairs that could meet (RobotSolids::Pairs). Metres; weight: sigma.
class RobotSelfTerm final : public RobotTerm {
 public:
  RobotSelfTerm(const RobotSolids& solids, double sigma_m)
      : solids_(solids), weight_(1.0 / sigma_m), near_(2 * solids.Pairs().size()) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    for (std::size_t k = 0; k < solids_.Pairs().size(); ++k) {
      const auto& [a, b] = solids_.Pairs()[k];
      const Eigen::Vector3d between = robot.ObjectFromLink(a) * solids_.Of(a).centre -
                                      robot.ObjectFromLink(b) * solids_.Of(b).centre;
      const double reach = solids_.Of(a).radius + solids_.Of(b).radius;
      if (between.squaredNorm() > reach * reach) continue;
      cost += AddInto(robot, a, b, near_[2 * k], normal) +
              AddInto(robot, b, a, near_[2 * k + 1], normal);
    }
    return cost;
  }

 private:
  // Points of `first` in `second`.
  double AddInto(const PosedRobot& robot, int first, int second, NearSamples& near,
                 RobotNormal* normal) const {
    const LinkSolid &from = solids_.Of(first), &into = solids_.Of(second);
    const Eigen::Isometry3d& pose = robot.ObjectFromLink(second);
    double cost = 0.0;
    near.ForNear({from.samples, from.centre, from.radius}, *into.grid,
                 pose.inverse() * robot.ObjectFromLink(first), 0.0,
                 [&](int, const Eigen::Vector3d& in_second) {
                   Eigen::Vector3d gradient;
                   const double r = -weight_ * into.grid->Distance(in_second, &gradient);
                   if (r <= 0.0) return;
                   cost += 0.5 * r * r;
                   if (normal == nullptr) return;
                   normal->AddBetween(first, second, pose * in_second,
                                      -weight_ * (pose.linear() * gradient), r);
                 });
    return cost;
  }

  const RobotSolids& solids_;
  double weight_;
  mutable std::vector<NearSamples> near_;  // of each pair, one way and the other
};

}  // namespace holdfast
