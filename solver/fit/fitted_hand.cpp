// SPDX-License-Identifier: MIT
#include "solver/fit/fitted_hand.h"

#include <algorithm>
#include <array>

#include "geometry/mesh/surface_distance.h"
#include "geometry/rotation.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

FitObject MakeFitObject(const TriangleMesh& mesh, const SignedDistance& surface,
                        const TriangleMesh& simplified, int threads) {
  FitObject object;
  object.vertices = simplified.vertices;
  DistanceGridOptions grid;
  grid.threads = threads;
  object.distance = std::make_shared<const DistanceGrid>(surface, grid);
  constexpr double kSpacing = 0.003;  // no fingertip fits between
  constexpr int kMost = 20'000;
  object.surface = ContactSamples(mesh, kSpacing, kMost);
  return object;
}

FittedHand::FittedHand(const HandModel& hand, const FitObject& object, const FitOptions& options)
    : object_(object), options_(options), anatomy_(hand), state_(hand) {
  if (options.lambda_limits > 0.0) {
    HandPriorWeights weights;
    weights.limits = std::sqrt(options.lambda_limits);
    weights.coupling = weights.neighbors = weights.stay = weights.spread = 0.0;
    limits_ = std::make_unique<HandPriorTerm>(anatomy_.axes, HandAngles::Zero(), weights);
  }
}

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
  RelativePose seen{object.orientation, object.translation};
  if (!step.IsZero()) {
    seen = SeenByUnmovedHand(state_.WristRotation(), state_.WristPosition(), object.orientation,
                             object.translation, step.rotation, step.translation);
  }
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
  if (!hold_->Slips()) return;
  hold_->SlipTerm()->MoveTo(InObject(object));
  block_->Invalidate();
}

Energies FittedHand::EnergiesAt(const ObjectPose& object) {
  const double* parameters[] = {object.orientation.coeffs().data(), object.translation.data(),
                                fingers.data()};
  return block_->EnergiesAt(parameters);
}

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

namespace {

// Parameters of the block that stand for a moved hand: the object relative to the unmoved hand.
struct UnmovedParameters {
  UnmovedParameters(const HandState& state, double const* const* parameters)
      : W(state.WristRotation()),
        p(state.WristPosition()),
        C(Eigen::Map<const Eigen::Quaterniond>(parameters[3])),
        seen(SeenByUnmovedHand(W, p, Eigen::Map<const Eigen::Quaterniond>(parameters[0]),
                               Eigen::Map<const Eigen::Vector3d>(parameters[1]), C,
                               Eigen::Map<const Eigen::Vector3d>(parameters[4]))),
        inner{seen.orientation.coeffs().data(), seen.translation.data(), parameters[2]} {}
  UnmovedParameters(const UnmovedParameters&) = delete;
  UnmovedParameters& operator=(const UnmovedParameters&) = delete;

  // Derivative of that pose by (R, T, C, c): R -> R exp(delta) passes through unchanged, T moves by
  // W C^T W^T dT; with C -> C exp(omega) it rotates by -(R_seen^T W) omega about the wrist.
  Eigen::Matrix<double, 6, 12> Jacobian() const {
    const Eigen::Matrix3d offset_inverse = C.toRotationMatrix().transpose();
    const Eigen::Vector3d arm = W.transpose() * (seen.translation - p);
    Eigen::Matrix<double, 6, 12> J = Eigen::Matrix<double, 6, 12>::Zero();
    J.block<3, 3>(0, 0).setIdentity();
    J.block<3, 3>(3, 3) = W * offset_inverse * W.transpose();
    J.block<3, 3>(0, 6) = -seen.orientation.toRotationMatrix().transpose() * W;
    J.block<3, 3>(3, 6) = W * Skew(arm);
    J.block<3, 3>(3, 9) = -W * offset_inverse;
    return J;
  }

  Eigen::Matrix3d W;
  Eigen::Vector3d p;
  Eigen::Quaterniond C;
  RelativePose seen;
  std::array<const double*, 3> inner;
};

}  // namespace

WristOffsetBlock::WristOffsetBlock(const HandObjectBlock* block, const HandState* state)
    : block_(block), state_(state) {
  set_num_residuals(HandObjectBlock::kRows);
  *mutable_parameter_block_sizes() = {4, 3, kHandDofs, 4, 3};
}

bool WristOffsetBlock::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const UnmovedParameters unmoved(*state_, parameters);
  if (jacobians == nullptr) return block_->Evaluate(unmoved.inner.data(), residuals, nullptr);

  constexpr int kRows = HandObjectBlock::kRows;
  using Rows3 = Eigen::Matrix<double, kRows, 3, Eigen::RowMajor>;
  using Rows4 = Eigen::Matrix<double, kRows, 4, Eigen::RowMajor>;
  Rows4 J_orientation;
  Rows3 J_translation;
  double* inner_jacobians[] = {J_orientation.data(), J_translation.data(), jacobians[2]};
  if (!block_->Evaluate(unmoved.inner.data(), residuals, inner_jacobians)) return false;
  const Rows3 J_turn =
      J_orientation * RotationManifold::PlusJacobianAt(unmoved.seen.orientation.coeffs().data());

  const Eigen::Matrix<double, 6, 12> J_seen = unmoved.Jacobian();
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
