// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "solver/robot/robot_solids.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

/// Links stay out of each other: as RobotPenetrationTerm, for points of one link in the other, over
/// the pairs that could meet (RobotSolids::Pairs). Metres; weight: sigma.
class RobotSelfTerm final : public RobotTerm {
 public:
  RobotSelfTerm(const RobotSolids& solids, double sigma_m)
      : solids_(solids), weight_(1.0 / sigma_m) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    for (const auto& [a, b] : solids_.Pairs()) {
      const Eigen::Vector3d between = robot.ObjectFromLink(a) * solids_.Of(a).centre -
                                      robot.ObjectFromLink(b) * solids_.Of(b).centre;
      const double reach = solids_.Of(a).radius + solids_.Of(b).radius;
      if (between.squaredNorm() > reach * reach) continue;
      cost += AddInto(robot, a, b, normal) + AddInto(robot, b, a, normal);
    }
    return cost;
  }

 private:
  // Points of `first` in `second`.
  double AddInto(const PosedRobot& robot, int first, int second, RobotNormal* normal) const {
    const LinkSolid &from = solids_.Of(first), &into = solids_.Of(second);
    const Eigen::Isometry3d& pose = robot.ObjectFromLink(second);
    const Eigen::Isometry3d second_from_first = pose.inverse() * robot.ObjectFromLink(first);
    double cost = 0.0;
    Eigen::Vector3d gradient;
    for (const auto sample : from.samples.colwise()) {
      const Eigen::Vector3d in_second = second_from_first * sample;
      if ((in_second - into.centre).squaredNorm() > into.radius * into.radius) continue;
      if (into.grid->Linear(in_second) > 0.001) continue;
      const double r = -weight_ * into.grid->Distance(in_second, &gradient);
      if (r <= 0.0) continue;
      cost += 0.5 * r * r;
      if (normal != nullptr) {
        normal->AddBetween(first, second, pose * in_second, -weight_ * (pose.linear() * gradient),
                           r);
      }
    }
    return cost;
  }

  const RobotSolids& solids_;
  double weight_;
};

}  // namespace holdfast
