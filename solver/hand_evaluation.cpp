// SPDX-License-Identifier: MIT
#include "solver/hand_evaluation.h"

namespace holdfast {

HandEvaluation::HandEvaluation(const HandModel& hand, const JointPose& pose,
                               const Eigen::Vector3d& trans)
    : state_(hand), group_(hand.NumVertices()), member_(hand.NumVertices()) {
  for (std::size_t g = 0; g < hand.Groups().size(); ++g) {
    const std::vector<int>& vertices = hand.Groups()[g].vertices;
    for (std::size_t m = 0; m < vertices.size(); ++m) {
      group_[vertices[m]] = static_cast<int>(g);
      member_[vertices[m]] = static_cast<int>(m);
    }
  }
  SetBody(pose, trans);
}

void HandEvaluation::SetBody(const JointPose& pose, const Eigen::Vector3d& trans) {
  state_.SetBody(pose, trans);
  valid_ = false;
}

const HandState& HandEvaluation::At(const double* fingers, bool with_jacobian) {
  const Eigen::Map<const FingerPose> wanted(fingers);
  if (valid_ && fingers_ == wanted && (has_jacobian_ || !with_jacobian)) return state_;
  fingers_ = wanted;
  state_.Evaluate(fingers_, with_jacobian);
  valid_ = true;
  has_jacobian_ = with_jacobian;
  return state_;
}

void HandEvaluation::AddRow(int vertex, const Eigen::Vector3d& direction, double* row) const {
  const HandModel::Group& group = state_.Hand().Groups()[group_[vertex]];
  const JacobianMatrix& J = state_.GroupJacobian(group_[vertex]);
  const Eigen::Index first = 3 * static_cast<Eigen::Index>(member_[vertex]);
  for (std::size_t k = 0; k < group.joints.size(); ++k) {
    Eigen::Map<Eigen::RowVector3d>(row + 3 * group.joints[k]) +=
        direction.transpose() * J.block<3, 3>(first, 3 * static_cast<Eigen::Index>(k));
  }
}

}  // namespace holdfast
