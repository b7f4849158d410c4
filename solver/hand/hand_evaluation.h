// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "geometry/body/hand_model.h"

namespace holdfast {

/// A hand state shared by the residual blocks of one problem: evaluated once per finger pose,
/// however many terms ask. Not for use by several threads: give each problem its own, and solve
/// with `num_threads = 1`.
class HandEvaluation {
 public:
  /// `hand` must outlive this. The body is held at `pose` and `trans` (SetBody changes it).
  HandEvaluation(const HandModel& hand, const JointPose& pose, const Eigen::Vector3d& trans);

  void SetBody(const JointPose& pose, const Eigen::Vector3d& trans);
  const HandModel& Hand() const { return state_.Hand(); }

  /// The state for these 45 numbers; valid until the next call.
  const HandState& At(const double* fingers, bool with_jacobian);

  /// row += direction^T d vertex / d fingers (`row` has 45 entries), for the pose of the last call
  /// of At, which must have asked for the Jacobian.
  void AddRow(int vertex, const Eigen::Vector3d& direction, double* row) const {
    state_.AddJacobianRow(vertex, direction, row);
  }

 private:
  HandState state_;
  FingerPose fingers_;
  bool valid_ = false;
  bool has_jacobian_ = false;
};

}  // namespace holdfast
