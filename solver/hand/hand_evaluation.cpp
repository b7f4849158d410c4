// SPDX-License-Identifier: MIT
#include "solver/hand/hand_evaluation.h"

namespace holdfast {

HandEvaluation::HandEvaluation(const HandModel& hand, const JointPose& pose,
                               const Eigen::Vector3d& trans)
    : state_(hand) {
  SetBody(pose, trans);
}

void HandEvaluation::SetBody(const JointPose& pose, const Eigen::Vector3d& trans) {
  state_.SetBody(pose, trans);
  valid_ = false;
}

const HandState& HandEvaluation::At(const double* fingers, bool with_jacobian) {
  const Eigen::Map<const FingerPose> wanted(fingers);
  if (valid_ && fingers_ == wanted) {
    if (with_jacobian && !has_jacobian_) state_.EvaluateJacobians();
    has_jacobian_ |= with_jacobian;
    return state_;
  }
  fingers_ = wanted;
  state_.Evaluate(fingers_, with_jacobian);
  valid_ = true;
  has_jacobian_ = with_jacobian;
  return state_;
}

}  // namespace holdfast
