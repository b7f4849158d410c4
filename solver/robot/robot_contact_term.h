// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "solver/robot/robot_pads.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

/// Where a part of the human hand touches the object.
struct PartContact {
  int part = 0;                                      ///< 15 phalanges, then the palm
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< of the object's surface, its frame
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< out of the object, unit
  double weight = 1.0;
};

struct ContactSigmas {
  double distance_m = 0.001;
  double turn_rad = 0.1;
};

/// S kept: what a part of the human hand touched, the pad of the robot's part touches, face to
/// face,
///
///   E_c = sum_c w_c ( |x - p_c|^2 / sigma_d^2 + |m + n_c|^2 / sigma_n^2 )
///
/// x and m the place of the part's pad and its outward normal that are nearest to the contact now
/// (both measures together: the pad may roll along), p_c and n_c the object's. Object's frame,
/// metres; 3 + 3 residuals a contact. Weights: sigma_d (metres) and sigma_n (radians).
class RobotContactTerm final : public RobotTerm {
 public:
  RobotContactTerm(const RobotPads& pads, std::vector<PartContact> contacts,
                   const ContactSigmas& sigmas)
      : pads_(pads),
        contacts_(std::move(contacts)),
        by_place_(1.0 / (sigmas.distance_m * sigmas.distance_m)),
        by_turn_(1.0 / (sigmas.turn_rad * sigmas.turn_rad)) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    for (const PartContact& contact : contacts_) {
      double least = 0.0;
      const std::optional<PadPoint> pad = pads_.BestFacing(
          contact.part, robot, contact.point, contact.normal, by_place_, by_turn_, &least);
      if (!pad) continue;
      cost += 0.5 * contact.weight * least;
      if (normal == nullptr) continue;
      const Eigen::Isometry3d& pose = robot.ObjectFromLink(pad->link);
      const Eigen::Vector3d x = pose * pad->point;
      const Eigen::Vector3d m = pose.linear() * pad->normal;
      const double d = contact.weight * by_place_, t = contact.weight * by_turn_;
      normal->AddPoint(pad->link, x, d * (x - contact.point), d * Eigen::Matrix3d::Identity());
      normal->AddTurn(pad->link, t * m.cross(contact.normal),
                      t * (Eigen::Matrix3d::Identity() - m * m.transpose()));
    }
    return cost;
  }

 private:
  const RobotPads& pads_;
  std::vector<PartContact> contacts_;
  double by_place_, by_turn_;
};

}  // namespace holdfast
