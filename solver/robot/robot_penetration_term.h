// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "solver/robot/robot_solids.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

/// An object as a robot's hand meets it.
struct RobotObstacle {
  const DistanceGrid* grid = nullptr;
  Eigen::Matrix3Xd samples;  ///< of its surface
};

/// Penetration both ways: points of the links in the object, and points of the object in the links,
///
///   E_p = sum_i max(0, margin - d(x_i))^2 / sigma^2
///
/// d the signed distance (negative inside) of the other solid. Metres; a residual for each point
/// nearer than the margin. Never false. Weight: sigma.
class RobotPenetrationTerm final : public RobotTerm {
 public:
  RobotPenetrationTerm(const RobotSolids& solids, const RobotObstacle& object, double margin_m,
                       double sigma_m)
      : solids_(solids), object_(object), margin_(margin_m), weight_(1.0 / sigma_m) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    Eigen::Vector3d gradient;
    for (const int link : solids_.Links()) {
      const LinkSolid& solid = solids_.Of(link);
      const Eigen::Isometry3d& pose = robot.ObjectFromLink(link);
      const Eigen::Vector3d centre = pose * solid.centre;
      if (object_.grid->Linear(centre) > solid.radius + margin_ + 0.004) continue;
      for (const auto sample : solid.samples.colwise()) {
        const Eigen::Vector3d x = pose * sample;
        if (object_.grid->Linear(x) > margin_ + 0.001) continue;
        const double r = weight_ * (margin_ - object_.grid->Distance(x, &gradient));
        if (r <= 0.0) continue;
        cost += 0.5 * r * r;
        if (normal != nullptr) normal->AddPointRow(link, x, -weight_ * gradient, r);
      }
      const double reach = (solid.radius + margin_) * (solid.radius + margin_);
      const Eigen::Isometry3d link_from_object = pose.inverse();
      for (Eigen::Index j = 0; j < object_.samples.cols(); ++j) {
        const Eigen::Vector3d x = object_.samples.col(j);
        if ((x - centre).squaredNorm() > reach) continue;
        const Eigen::Vector3d in_link = link_from_object * x;
        if (!InBox(*solid.grid, in_link)) continue;
        if (solid.grid->Linear(in_link) > margin_ + 0.001) continue;
        const double r = weight_ * (margin_ - solid.grid->Distance(in_link, &gradient));
        if (r <= 0.0) continue;
        cost += 0.5 * r * r;
        // The link's material at x moves; the object's point stays: the distance changes the other
        // way round.
        if (normal != nullptr) {
          normal->AddPointRow(link, x, weight_ * (pose.linear() * gradient), r);
        }
      }
    }
    return cost;
  }

 private:
  static bool InBox(const DistanceGrid& grid, const Eigen::Vector3d& x) {
    return (x.array() > grid.Min().array()).all() && (x.array() < grid.Max().array()).all();
  }

  const RobotSolids& solids_;
  const RobotObstacle& object_;
  double margin_, weight_;
};

}  // namespace holdfast
