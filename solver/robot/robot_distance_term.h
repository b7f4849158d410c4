// SPDX-License-Identifier: MIT
#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

#include "solver/robot/hand_correspondence.h"
#include "solver/robot/robot_term.h"
#include "solver/terms/hand/hand_object_distance.h"

namespace holdfast {

/// E_d on the interaction mesh: the robot's skin keeps the distances to the object that the human's
/// has in this frame (IMoS, Ghosh et al. 2023, eq. 7; between two hands as in OmniRetarget, Yang et
/// al. 2025, whose Laplacian stands on the same edges),
///
///   E_d = sum_i w_i / M sum_j ( |x_i(pose) - o_j| - |v_i - o_j| )^2 / sigma^2
///
/// x_i the robot's point, v_i the human's that it stands for, o_j the M object points; all in the
/// object's frame, metres. Summed exactly to 3 x 3 a point (HandObjectDistance), then to 6 x 6 a
/// link. Weights: w_i, 1 at the surface.
class RobotDistanceTerm final : public RobotTerm {
 public:
  /// `human` (3 x n): v_i of each pair.
  RobotDistanceTerm(const std::vector<SkinPair>& pairs, const Eigen::Matrix3Xd& human,
                    const Eigen::Matrix3Xd& object, Eigen::VectorXd weights, double sigma_m)
      : pairs_(pairs),
        distances_(object, HandObjectDistance::Distances(human, object),
                   1.0 / (sigma_m * sigma_m * static_cast<double>(object.cols()))),
        weights_(std::move(weights)),
        x_(3, human.cols()),
        sums_(pairs.size()) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      x_.col(static_cast<Eigen::Index>(i)) = robot.ObjectFromLink(pairs_[i].link) * pairs_[i].point;
      sums_[i] = {Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero(), 0.0};
    }
    distances_.Add(x_, sums_);
    double cost = 0.0;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      cost += weights_(k) * sums_[i].cost;
      if (normal == nullptr) continue;
      normal->AddPoint(pairs_[i].link, x_.col(k), weights_(k) * sums_[i].gradient,
                       weights_(k) * sums_[i].hessian);
    }
    return cost;
  }

 private:
  const std::vector<SkinPair>& pairs_;
  HandObjectDistance distances_;
  Eigen::VectorXd weights_;
  mutable Eigen::Matrix3Xd x_;  // scratch
  mutable std::vector<VertexQuadratic> sums_;
};

}  // namespace holdfast
