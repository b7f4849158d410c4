// SPDX-License-Identifier: MIT
#include "solver/fit/wrist_offset_block.h"

#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

RelativePose SeenByUnmovedHand(const Eigen::Matrix3d& wrist_rotation,
                               const Eigen::Vector3d& wrist_position, const Eigen::Quaterniond& q,
                               const Eigen::Vector3d& translation,
                               const Eigen::Quaterniond& offset_rotation,
                               const Eigen::Vector3d& offset) {
  const Eigen::Quaterniond W(wrist_rotation);
  const Eigen::Vector3d in_wrist = W.conjugate() * (translation - wrist_position);
  return {W * offset_rotation.conjugate() * W.conjugate() * q,
          wrist_position + W * (offset_rotation.conjugate() * (in_wrist - offset))};
}

WristOffsetBlock::WristOffsetBlock(const HandObjectBlock* block, const HandState* state)
    : block_(block), state_(state) {
  set_num_residuals(HandObjectBlock::kRows);
  *mutable_parameter_block_sizes() = {4, 3, kHandDofs, 4, 3};
}

bool WristOffsetBlock::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]), C(parameters[3]);
  const Eigen::Map<const Eigen::Vector3d> T(parameters[1]), c(parameters[4]);
  const Eigen::Matrix3d W = state_->WristRotation();
  const Eigen::Vector3d p = state_->WristPosition();
  const RelativePose seen = SeenByUnmovedHand(W, p, q, T, C, c);
  const double* inner[] = {seen.orientation.coeffs().data(), seen.translation.data(),
                           parameters[2]};
  if (jacobians == nullptr) return block_->Evaluate(inner, residuals, nullptr);

  constexpr int kRows = HandObjectBlock::kRows;
  using Rows3 = Eigen::Matrix<double, kRows, 3, Eigen::RowMajor>;
  using Rows4 = Eigen::Matrix<double, kRows, 4, Eigen::RowMajor>;
  Rows4 J_orientation;
  Rows3 J_translation;
  double* inner_jacobians[] = {J_orientation.data(), J_translation.data(), jacobians[2]};
  if (!block_->Evaluate(inner, residuals, inner_jacobians)) return false;
  const Rows3 J_turn =
      J_orientation * RotationManifold::PlusJacobianAt(seen.orientation.coeffs().data());

  // R -> R exp(delta) passes through unchanged; T moves by W C^T W^T dT.
  const Eigen::Matrix3d offset_inverse = C.toRotationMatrix().transpose();
  if (jacobians[0] != nullptr) {
    Eigen::Map<Rows4> J(jacobians[0]);
    J = RotationManifold::Lift(J_turn, parameters[0]);
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Rows3> J(jacobians[1]);
    J = J_translation * (W * offset_inverse * W.transpose());
  }
  // C -> C exp(omega): the object seen turns by -(R_seen^T W) omega about the wrist.
  if (jacobians[3] != nullptr) {
    const Eigen::Matrix3d seen_to_wrist = seen.orientation.toRotationMatrix().transpose() * W;
    const Eigen::Vector3d arm = W.transpose() * (seen.translation - p);
    const Rows3 J_omega = -J_turn * seen_to_wrist + J_translation * (W * Skew(arm));
    Eigen::Map<Rows4> J(jacobians[3]);
    J = RotationManifold::Lift(J_omega, parameters[3]);
  }
  if (jacobians[4] != nullptr) {
    Eigen::Map<Rows3> J(jacobians[4]);
    J = -J_translation * (W * offset_inverse);
  }
  return true;
}

double WristOffsetBlock::CostAt(double const* const* parameters) const {
  const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]), C(parameters[3]);
  const Eigen::Map<const Eigen::Vector3d> T(parameters[1]), c(parameters[4]);
  const RelativePose seen =
      SeenByUnmovedHand(state_->WristRotation(), state_->WristPosition(), q, T, C, c);
  const double* inner[] = {seen.orientation.coeffs().data(), seen.translation.data(),
                           parameters[2]};
  return block_->CostAt(inner);
}

void WristOffsetBlock::NormalEquations(double const* const* parameters,
                                       Eigen::Ref<Eigen::MatrixXd> hessian,
                                       Eigen::Ref<Eigen::VectorXd> gradient) const {
  const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]), C(parameters[3]);
  const Eigen::Map<const Eigen::Vector3d> T(parameters[1]), c(parameters[4]);
  const Eigen::Matrix3d W = state_->WristRotation();
  const Eigen::Vector3d p = state_->WristPosition();
  const RelativePose seen = SeenByUnmovedHand(W, p, q, T, C, c);
  const double* inner[] = {seen.orientation.coeffs().data(), seen.translation.data(),
                           parameters[2]};
  const HandObjectBlock::System& system = block_->Linearized(inner);
  // How the pose that the block sees moves with (R, T, C, c), as in Evaluate.
  const Eigen::Matrix3d offset_inverse = C.toRotationMatrix().transpose();
  const Eigen::Vector3d arm = W.transpose() * (seen.translation - p);
  Eigen::Matrix<double, 6, 12> J = Eigen::Matrix<double, 6, 12>::Zero();
  J.block<3, 3>(0, 0).setIdentity();
  J.block<3, 3>(3, 3) = W * offset_inverse * W.transpose();
  J.block<3, 3>(0, 6) = -seen.orientation.toRotationMatrix().transpose() * W;
  J.block<3, 3>(3, 6) = W * Skew(arm);
  J.block<3, 3>(3, 9) = -W * offset_inverse;
  const Eigen::Matrix<double, 12, 12> poses =
      J.transpose() * system.hessian.topLeftCorner<6, 6>() * J;
  const Eigen::Matrix<double, 12, kHandDofs> across =
      J.transpose() * system.hessian.topRightCorner<6, kHandDofs>();
  const Eigen::Matrix<double, 12, 1> by_poses = J.transpose() * system.gradient.head<6>();
  constexpr Eigen::Index kAt[2] = {0, 6 + kHandDofs};  // of (R, T) and (C, c)
  for (int a = 0; a < 2; ++a) {
    for (int b = 0; b < 2; ++b) {
      hessian.block<6, 6>(kAt[a], kAt[b]) = poses.block<6, 6>(6 * a, 6 * b);
    }
    hessian.block<6, kHandDofs>(kAt[a], 6) = across.middleRows<6>(6 * a);
    hessian.block<kHandDofs, 6>(6, kAt[a]) = across.middleRows<6>(6 * a).transpose();
    gradient.segment<6>(kAt[a]) = by_poses.segment<6>(6 * a);
  }
  hessian.block<kHandDofs, kHandDofs>(6, 6) =
      system.hessian.bottomRightCorner<kHandDofs, kHandDofs>();
  gradient.segment<kHandDofs>(6) = system.gradient.tail<kHandDofs>();
}

}  // namespace holdfast
