// SPDX-License-Identifier: MIT
#include "solver/fit/fitted_hand.h"

#include <algorithm>

#include "geometry/mesh/contact_samples.h"
#include "solver/fit/wrist_offset_block.h"

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
    weights.coupling = weights.neighbours = weights.stay = weights.spread = 0.0;
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

}  // namespace holdfast
