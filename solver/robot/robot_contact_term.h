// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "solver/robot/hand_correspondence.h"
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
  RobotContactTerm(const std::vector<SkinPair>& pairs,
                   const std::vector<std::vector<int>>& pad_of_part,
                   std::vector<PartContact> contacts, const ContactSigmas& sigmas)
      : pairs_(pairs), pads_(pad_of_part), contacts_(std::move(contacts)), sigmas_(sigmas) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    const double by_distance = 1.0 / (sigmas_.distance_m * sigmas_.distance_m);
    const double by_turn = 1.0 / (sigmas_.turn_rad * sigmas_.turn_rad);
    double cost = 0.0;
    for (const PartContact& contact : contacts_) {
      double least = std::numeric_limits<double>::infinity();
      const SkinPair* nearest = nullptr;
      for (const int i : pads_[static_cast<std::size_t>(contact.part)]) {
        const SkinPair& pair = pairs_[static_cast<std::size_t>(i)];
        const Eigen::Isometry3d& pose = robot.ObjectFromLink(pair.link);
        const double value = by_distance * (pose * pair.point - contact.point).squaredNorm() +
                             by_turn * (pose.linear() * pair.normal + contact.normal).squaredNorm();
        if (value >= least) continue;
        least = value;
        nearest = &pair;
      }
      if (nearest == nullptr) continue;
      cost += 0.5 * contact.weight * least;
      if (normal == nullptr) continue;
      const Eigen::Isometry3d& pose = robot.ObjectFromLink(nearest->link);
      const Eigen::Vector3d x = pose * nearest->point;
      const Eigen::Vector3d m = pose.linear() * nearest->normal;
      const double d = contact.weight * by_distance, t = contact.weight * by_turn;
      normal->AddPoint(nearest->link, x, d * (x - contact.point), d * Eigen::Matrix3d::Identity());
      normal->AddTurn(nearest->link, t * m.cross(contact.normal),
                      t * (Eigen::Matrix3d::Identity() - m * m.transpose()));
    }
    return cost;
  }

 private:
  const std::vector<SkinPair>& pairs_;
  const std::vector<std::vector<int>>& pads_;
  std::vector<PartContact> contacts_;
  ContactSigmas sigmas_;
};

}  // namespace holdfast
