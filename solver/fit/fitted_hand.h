// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include <ceres/cost_function.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "solver/fit/fit_options.h"
#include "solver/fit/hand_object_block.h"
#include "solver/fit/hold_terms.h"
#include "solver/terms/hand/hand_prior.h"

namespace holdfast {

/// One hand of a fit: its terms with the object during a hold, with D and S from the frame in which
/// the hold started, and its current solution. Not thread-safe.
class FittedHand {
 public:
  /// `hand` and `object` must outlive this.
  FittedHand(const HandModel& hand, const FitObject& object, const FitOptions& options);
  FittedHand(const FittedHand&) = delete;
  FittedHand& operator=(const FittedHand&) = delete;

  Side HandSide() const { return state_.Hand().HandSide(); }
  bool Holds() const { return block_ != nullptr; }
  const HandState& State() const { return state_; }
  HandObjectBlock& Block() { return *block_; }
  HandPriorTerm* Limits() { return limits_.get(); }  ///< null when off
  /// Weights of E_c and E_t, on the sums.
  double ContactWeight() const { return hold_ ? hold_->ContactWeight() : 0.0; }
  double TemporalWeight() const {
    return options_.TemporalWeight(static_cast<double>(state_.Hand().NumVertices()) *
                                   static_cast<double>(object_.vertices.cols()));
  }
  int NumContactPairs() const { return hold_ ? hold_->NumContacts() : 0; }

  /// Sets the body of this frame, including the hand's own offset.
  void SetBody(const JointPose& pose, const Eigen::Vector3d& trans);

  /// Starts a hold: D and S from the current body, the fingers `closed` and the object pose.
  void TakeHold(const FingerPose& closed, const ObjectPose& object) {
    TakeHold(closed, object, options_.slip);
  }
  void TakeHold(const FingerPose& closed, const ObjectPose& object, bool slip);
  void Release() { block_.reset(); }

  /// HandObjectBlock::Watch at the current fingers, with the wrist moved by `step` from the current
  /// body.
  bool Watch(const ObjectPose& object, const WristOffset& step);

  /// The hand at the current fingers in the object frame (3 x N), meters.
  Eigen::Matrix3Xd InObject(const ObjectPose& object);

  /// Call when the frame is solved: updates the terms that depend on the last frame.
  void Keep(const ObjectPose& object);

  /// Energies at the current fingers and this object pose.
  Energies EnergiesAt(const ObjectPose& object);

  FingerPose fingers = FingerPose::Zero();  ///< of the last frame solved
  WristOffset offset;                       ///< of the last frame solved

 private:
  const FitObject& object_;
  FitOptions options_;
  HandAnatomy anatomy_;
  HandState state_;
  std::unique_ptr<HandPriorTerm> limits_;
  std::unique_ptr<HoldTerms> hold_;
  SkinTerms skin_terms_;
  std::unique_ptr<HandObjectBlock> block_;  // null while the hand does not hold
};

/// A HandObjectBlock whose hand may also move as a whole: two wrists that were captured or
/// synthesized never keep exactly the distance that a rigid object between them requires.
///
/// With the wrist's world pose (W, p), the hand's vertices become
///   v' = p + W (C W^T (v - p) + c),
/// C in SO(3) and c (meters) in the wrist frame. Moving the hand by (C, c) is moving the object by
/// the inverse, so the block needs no Jacobian of its own beyond a change of variables.
///
/// Parameter blocks: orientation (4), translation (3), fingers (45) as in HandObjectBlock, then C
/// (4, x y z w, with RotationManifold) and c (3). Residuals: 52, those of the block.
class WristOffsetBlock final : public ceres::CostFunction {
 public:
  /// `block` and `state` (that of the block) must outlive this; the state's body must be set.
  WristOffsetBlock(const HandObjectBlock* block, const HandState* state);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const HandObjectBlock* block_;
  const HandState* state_;
};

/// Object pose relative to the unmoved hand, equivalent to `object` for the hand moved by `offset`.
ObjectPose SeenByUnmovedHand(const HandState& state, const ObjectPose& object,
                             const WristOffset& offset);

}  // namespace holdfast
