// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "solver/robot/near_samples.h"
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
/// nearer than the margin. Weight: sigma. Not for
/// use by several threads at a time.
class RobotPenetrationTerm final : public RobotTerm {
 public:
  RobotPenetrationTerm(const RobotSolids& solids, const RobotObstacle& object, double margin_m,
                       double sigma_m)
      : solids_(solids),
        object_(object),
        margin_(margin_m),
        weight_(1.0 / sigma_m),
        near_(solids.Links().size()) {}

  /// For solves that begin loosely.
  void SetSigma(double sigma_m) { weight_ = 1.0 / sigma_m; }

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    ForNearLinks(robot, [&](int link, const LinkSolid& solid, const Eigen::Isometry3d& pose,
                            Near& near) {
      cost += AddLink(link, solid, pose, near, normal) + AddObject(link, solid, pose, near, normal);
    });
    return cost;
  }

  /// The deepest of all points, metres; 0 where none is inside. Distances interpolated linearly.
  double Deepest(const PosedRobot& robot) const {
    double deepest = 0.0;
    ForNearLinks(robot,
                 [&](int, const LinkSolid& solid, const Eigen::Isometry3d& pose, Near& near) {
                   ForLinkPoints(solid, pose, near, [&](const Eigen::Vector3d& x) {
                     deepest = std::max(deepest, -object_.grid->Linear(x));
                   });
                   ForObjectPoints(solid, pose, near, [&](int, const Eigen::Vector3d& in_link) {
                     deepest = std::max(deepest, -solid.grid->Linear(in_link));
                   });
                 });
    return deepest;
  }

 private:
  static constexpr double kNear_m = 0.004;  // of what is looked at more closely
  struct Near {
    NearSamples of_link, of_object;
  };

  template <typename Visit>
  void ForNearLinks(const PosedRobot& robot, const Visit& visit) const {
    for (std::size_t k = 0; k < solids_.Links().size(); ++k) {
      const int link = solids_.Links()[k];
      const LinkSolid& solid = solids_.Of(link);
      const Eigen::Isometry3d& pose = robot.ObjectFromLink(link);
      if (object_.grid->Linear(pose * solid.centre) > solid.radius + margin_ + kNear_m) continue;
      visit(link, solid, pose, near_[k]);
    }
  }

  // The link's points that may be in the object, in the object's frame.
  template <typename Visit>
  void ForLinkPoints(const LinkSolid& solid, const Eigen::Isometry3d& pose, Near& near,
                     const Visit& visit) const {
    near.of_link.ForNear({solid.samples, solid.centre, solid.radius}, *object_.grid, pose, margin_,
                         [&](int, const Eigen::Vector3d& x) { visit(x); });
  }

  // The object's points that may be in the link, in the link's frame.
  template <typename Visit>
  void ForObjectPoints(const LinkSolid& solid, const Eigen::Isometry3d& pose, Near& near,
                       const Visit& visit) const {
    near.of_object.ForNear(
        {object_.samples, pose * solid.centre, solid.radius + NearSamples::kAround_m}, *solid.grid,
        pose.inverse(), margin_, [&](int j, const Eigen::Vector3d& in_link) {
          if (InBox(*solid.grid, in_link)) visit(j, in_link);
        });
  }

  double AddLink(int link, const LinkSolid& solid, const Eigen::Isometry3d& pose, Near& near,
                 RobotNormal* normal) const {
    double cost = 0.0;
    ForLinkPoints(solid, pose, near, [&](const Eigen::Vector3d& x) {
      Eigen::Vector3d gradient;
      const double r = weight_ * (margin_ - object_.grid->Distance(x, &gradient));
      if (r <= 0.0) return;
      cost += 0.5 * r * r;
      if (normal != nullptr) normal->AddPointRow(link, x, -weight_ * gradient, r);
    });
    return cost;
  }

  // The link's material at an object's point moves and the point stays: the distance changes the
  // other way round.
  double AddObject(int link, const LinkSolid& solid, const Eigen::Isometry3d& pose, Near& near,
                   RobotNormal* normal) const {
    double cost = 0.0;
    ForObjectPoints(solid, pose, near, [&](int j, const Eigen::Vector3d& in_link) {
      Eigen::Vector3d gradient;
      const double r = weight_ * (margin_ - solid.grid->Distance(in_link, &gradient));
      if (r <= 0.0) return;
      cost += 0.5 * r * r;
      if (normal == nullptr) return;
      normal->AddPointRow(link, object_.samples.col(j), weight_ * (pose.linear() * gradient), r);
    });
    return cost;
  }

  static bool InBox(const DistanceGrid& grid, const Eigen::Vector3d& x) {
    return (x.array() > grid.Min().array()).all() && (x.array() < grid.Max().array()).all();
  }

  const RobotSolids& solids_;
  const RobotObstacle& object_;
  double margin_, weight_;
  mutable std::vector<Near> near_;  // by RobotSolids::Links
};

}  // namespace holdfast
