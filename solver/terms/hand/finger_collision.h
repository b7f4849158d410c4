// SPDX-License-Identifier: MIT
#pragma once

#include <utility>
#include <vector>

#include <ceres/cost_function.h>

#include <Eigen/Core>

#include "solver/hand/hand_evaluation.h"
#include "solver/hand/hand_landmarks.h"

namespace holdfast {

/// Fingers stay out of each other: for pairs of finger balls with centres c,
///
///   r = w max(0, free_distance - |c_1 - c_2|)
///
/// Parameter block: finger pose P (45, radians).
class FingerCollisionTerm final : public ceres::CostFunction {
 public:
  /// `hand` and `landmarks` must outlive the term. `weight` is per metre.
  FingerCollisionTerm(HandEvaluation& hand, const HandLandmarks& landmarks,
                      std::vector<HandLandmarks::BallPair> pairs, double weight)
      : hand_(hand), landmarks_(landmarks), pairs_(std::move(pairs)), weight_(weight) {
    set_num_residuals(static_cast<int>(pairs_.size()));
    *mutable_parameter_block_sizes() = {kHandDofs};
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const bool with_jacobian = jacobians && jacobians[0];
    const HandState& state = hand_.At(parameters[0], with_jacobian);
    Eigen::Matrix3Xd centers;
    BallCenters(landmarks_, state.Vertices(), centers);
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const HandLandmarks::BallPair& pair = pairs_[i];
      const Eigen::Vector3d apart = centers.col(pair.first) - centers.col(pair.second);
      const double distance = apart.norm();
      const double overlap = pair.free_distance - distance;
      residuals[i] = weight_ * std::max(0.0, overlap);
      if (!with_jacobian) continue;
      double* const row = jacobians[0] + kHandDofs * i;
      std::fill(row, row + kHandDofs, 0.0);
      if (overlap <= 0.0 || distance == 0.0) continue;
      const Eigen::Vector3d direction = -weight_ / distance * apart;
      AddBall(pair.first, direction, row);
      AddBall(pair.second, -direction, row);
    }
    return true;
  }

 private:
  void AddBall(int ball, const Eigen::Vector3d& direction, double* row) const {
    const std::vector<int>& ring = landmarks_.Balls()[ball].ring;
    const Eigen::Vector3d share = direction / static_cast<double>(ring.size());
    for (const int vertex : ring) hand_.AddRow(vertex, share, row);
  }

  HandEvaluation& hand_;
  const HandLandmarks& landmarks_;
  std::vector<HandLandmarks::BallPair> pairs_;
  double weight_;
};

}  // namespace holdfast
