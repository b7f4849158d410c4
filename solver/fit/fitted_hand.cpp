// SPDX-License-Identifier: MIT
#include "solver/fit/fitted_hand.h"

#include <cmath>

#include "geometry/mesh/surface_distance.h"
#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

FitObject MakeFitObject(const TriangleMesh& mesh, const SignedDistance& surface,
                        const TriangleMesh& simplified, int threads) {
  FitObject object;
  object.vertices = simplified.vertices;
  object.distance =
      std::make_shared<const DistanceGrid>(surface, DistanceGridOptions{.threads = threads});
  constexpr double kSpacing = 0.003;  // no fingertip fits between
  constexpr int kMost = 20'000;
  object.surface = ContactSamples(mesh, kSpacing, kMost);
  return object;
}

FittedHand::FittedHand(const HandModel& hand, const FitObject& object, const FitOptions& options)
    : object_(object),
      options_(options),
      anatomy_(hand),
      state_(hand),
      limits_(MakeLimits(anatomy_.axes, options)) {}

void FittedHand::SetBody(const JointPose& pose, const Eigen::Vector3d& trans) {
  state_.SetBody(pose, trans);
  if (block_) block_->Invalidate();
}

void FittedHand::TakeHold(const FingerPose& closed, const ObjectPose& object, bool slip) {
  fingers = closed;
  hold_ = std::make_unique<HoldTerms>(object_, InObject(object), slip, options_);
  block_ = std::make_unique<HandObjectBlock>(&state_);
  hold_->AddTo(*block_);
  skin_terms_ = MakeSkinTerms(anatomy_, object_, options_);
  for (const auto& [kind, term] : skin_terms_) block_->AddTerm(kind, term.get());
}

bool FittedHand::Watch(const ObjectPose& object, const WristOffset& step) {
  const ObjectPose seen = step.IsZero() ? object : SeenByUnmovedHand(state_, object, step);
  const double* parameters[] = {seen.orientation.coeffs().data(), seen.translation.data(),
                                fingers.data()};
  return block_->Watch(parameters);
}

Eigen::Matrix3Xd FittedHand::InObject(const ObjectPose& object) {
  state_.Evaluate(fingers, false);
  if (block_) block_->Invalidate();
  return InObjectFrame(state_.Vertices(), object.orientation, object.translation);
}

void FittedHand::Keep(const ObjectPose& object) {
  if (hold_->SlipTerm() == nullptr) return;
  hold_->SlipTerm()->MoveTo(InObject(object));
  block_->Invalidate();
}

Energies FittedHand::EnergiesAt(const ObjectPose& object) {
  const double* parameters[] = {object.orientation.coeffs().data(), object.translation.data(),
                                fingers.data()};
  return block_->EnergiesAt(parameters);
}

ObjectPose SeenByUnmovedHand(const HandState& state, const ObjectPose& object,
                             const WristOffset& offset) {
  const Eigen::Quaterniond W(state.WristRotation());
  const Eigen::Vector3d p = state.WristPosition();
  const Eigen::Vector3d in_wrist = W.conjugate() * (object.translation - p);
  return {W * offset.rotation.conjugate() * W.conjugate() * object.orientation,
          p + W * (offset.rotation.conjugate() * (in_wrist - offset.translation))};
}

WristOffsetBlock::WristOffsetBlock(const HandObjectBlock* block, const HandState* state)
    : block_(block), state_(state) {
  set_num_residuals(HandObjectBlock::kRows);
  *mutable_parameter_block_sizes() = {4, 3, kHandDofs, 4, 3};
}

bool WristOffsetBlock::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const Eigen::Matrix3d W = state_->WristRotation();
  const Eigen::Vector3d p = state_->WristPosition();
  const WristOffset offset{Eigen::Map<const Eigen::Quaterniond>(parameters[3]),
                           Eigen::Map<const Eigen::Vector3d>(parameters[4])};
  const ObjectPose seen = SeenByUnmovedHand(*state_,
                                            {Eigen::Map<const Eigen::Quaterniond>(parameters[0]),
                                             Eigen::Map<const Eigen::Vector3d>(parameters[1])},
                                            offset);
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

  // Derivative of the seen pose by (R, T, C, c): R -> R exp(delta) passes through unchanged, T
  // moves by W C^T W^T dT; with C -> C exp(omega) it rotates by -(R_seen^T W) omega about the
  // wrist.
  const Eigen::Matrix3d offset_inverse = offset.rotation.toRotationMatrix().transpose();
  const Eigen::Vector3d arm = W.transpose() * (seen.translation - p);
  Eigen::Matrix<double, 6, 12> J_seen = Eigen::Matrix<double, 6, 12>::Zero();
  J_seen.block<3, 3>(3, 3) = W * offset_inverse * W.transpose();
  J_seen.block<3, 3>(0, 6) = -seen.orientation.toRotationMatrix().transpose() * W;
  J_seen.block<3, 3>(3, 6) = W * Skew(arm);
  J_seen.block<3, 3>(3, 9) = -W * offset_inverse;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Rows4> J(jacobians[0]);
    J = RotationManifold::Lift(J_turn, parameters[0]);
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Rows3> J(jacobians[1]);
    J = J_translation * J_seen.block<3, 3>(3, 3);
  }
  if (jacobians[3] != nullptr) {
    const Rows3 J_omega =
        J_turn * J_seen.block<3, 3>(0, 6) + J_translation * J_seen.block<3, 3>(3, 6);
    Eigen::Map<Rows4> J(jacobians[3]);
    J = RotationManifold::Lift(J_omega, parameters[3]);
  }
  if (jacobians[4] != nullptr) {
    Eigen::Map<Rows3> J(jacobians[4]);
    J = J_translation * J_seen.block<3, 3>(3, 9);
  }
  return true;
}

}  // namespace holdfast
