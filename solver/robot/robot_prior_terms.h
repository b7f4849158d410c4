// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <utility>

#include <Eigen/Core>

#include "geometry/rotation.h"
#include "solver/robot/robot_term.h"

namespace holdfast {

/// Joint limits as walls: r_k = (low - q) / sigma below, (q - high) / sigma above. Radians (or
/// metres) of each number of the hand; weight: sigma. What is left over is clamped.
class RobotLimitTerm final : public RobotTerm {
 public:
  explicit RobotLimitTerm(double sigma) : weight_(1.0 / (sigma * sigma)) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    const auto& dofs = robot.Hand().dofs;
    for (int k = 0; k < robot.Hand().NumDofs(); ++k) {
      const double q = robot.Pose().q(k);
      const double over = q - std::clamp(q, dofs[k].low, dofs[k].high);
      if (over == 0.0) continue;
      cost += 0.5 * weight_ * over * over;
      if (normal != nullptr) normal->AddNumber(k, weight_ * over, weight_);
    }
    return cost;
  }

 private:
  double weight_;
};

/// The hand's numbers stay near others (the frame before's; at rest): r_k = (q_k - target_k) /
/// sigma_k. Radians or metres.
class RobotPostureTerm final : public RobotTerm {
 public:
  RobotPostureTerm(Eigen::VectorXd target, Eigen::VectorXd sigma)
      : target_(std::move(target)), weight_(sigma.cwiseAbs2().cwiseInverse()) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    const Eigen::VectorXd off = robot.Pose().q - target_;
    if (normal != nullptr) {
      for (Eigen::Index k = 0; k < off.size(); ++k) {
        normal->AddNumber(static_cast<int>(k), weight_(k) * off(k), weight_(k));
      }
    }
    return 0.5 * off.cwiseAbs2().dot(weight_);
  }

 private:
  Eigen::VectorXd target_, weight_;
};

/// The root stays near a pose (the frame before's; what the human wrist says): six residuals,
/// log(R_target^T R) / sigma_turn (radians) and the way of the point `centre` of the root's frame /
/// sigma (metres), so that a turn about it is free of way.
class RobotPlaceTerm final : public RobotTerm {
 public:
  RobotPlaceTerm(Eigen::Isometry3d object_from_root, Eigen::Vector3d centre, double sigma_turn,
                 double sigma_m)
      : target_(std::move(object_from_root)),
        centre_(std::move(centre)),
        turn_weight_(1.0 / (sigma_turn * sigma_turn)),
        weight_(1.0 / (sigma_m * sigma_m)) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    const RobotPose& pose = robot.Pose();
    const Eigen::Vector3d turn = LogSO3(target_.linear().transpose() * pose.R);
    const Eigen::Vector3d way = pose.R * centre_ + pose.T - target_ * centre_;
    if (normal != nullptr) {
      // R exp(delta): log moves by the inverse right Jacobian, that is the left one of -log.
      const Eigen::Matrix3d J_turn = InverseLeftJacobianSO3(-turn);
      Eigen::Matrix<double, 3, 6> J_way;
      J_way << -pose.R * Skew(centre_), Eigen::Matrix3d::Identity();
      Eigen::Matrix<double, 6, 6> hessian = weight_ * J_way.transpose() * J_way;
      Eigen::Matrix<double, 6, 1> gradient = weight_ * J_way.transpose() * way;
      hessian.topLeftCorner<3, 3>() += turn_weight_ * J_turn.transpose() * J_turn;
      gradient.head<3>() += turn_weight_ * J_turn.transpose() * turn;
      normal->AddBase(gradient, hessian);
    }
    return 0.5 * (turn_weight_ * turn.squaredNorm() + weight_ * way.squaredNorm());
  }

 private:
  Eigen::Isometry3d target_;
  Eigen::Vector3d centre_;
  double turn_weight_, weight_;
};

}  // namespace holdfast
