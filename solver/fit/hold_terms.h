// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "solver/fit/fit_options.h"
#include "solver/fit/hand_object_block.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/terms/hand/hand_prior.h"
#include "solver/terms/hand/object_in_hand.h"
#include "solver/terms/hand/paper_terms.h"
#include "solver/terms/hand/penetration.h"
#include "solver/terms/hand/vertex_goals.h"

namespace holdfast {

/// Terms that keep the relation at the start of a hold: the paper's E_d and E_c with D and S of
/// that moment, or Slip instead. Const while frames are solved, and shareable between threads.
class HoldTerms {
 public:
  /// `z` (3 x N): the hand in the object frame at the start of the hold, meters. `object` must
  /// outlive this. Slip needs the object's distance. With an empty `z` there are no terms.
  HoldTerms(const FitObject& object, const Eigen::Matrix3Xd& z, bool slip,
            const FitOptions& options) {
    if (z.cols() == 0) return;
    if (slip && object.distance) {
      slip_ = std::make_unique<Slip>(*object.distance, z, options.slip_touch_m, options.lambda_slip,
                                     options.drag_share);
      return;
    }
    const Eigen::MatrixXd distances = HandObjectDistance::Distances(z, object.vertices);
    distance_ = std::make_unique<HandObjectDistance>(object.vertices, distances,
                                                     options.lambda_distance, options.precision);
    const auto contacts = (distances.array() < options.contact_threshold_m).count();
    contact_weight_ =
        options.ContactWeight(static_cast<double>(distances.size()), static_cast<double>(contacts));
    contact_ = std::make_unique<Contact>(object.vertices, distances, options.contact_threshold_m,
                                         contact_weight_);
  }

  void AddTo(HandObjectBlock& block) const {
    if (slip_) {
      block.AddTerm(EnergyTerm::kSlip, slip_.get());
    } else if (distance_) {
      block.AddTerm(EnergyTerm::kDistance, distance_.get());
      block.AddTerm(EnergyTerm::kContact, contact_.get());
    }
  }

  double ContactWeight() const { return contact_weight_; }  ///< of E_c, on the sum
  Slip* SlipTerm() const { return slip_.get(); }            ///< null for a firm hold
  /// Number of pairs of S; with slip, of vertices in contact.
  int NumContacts() const {
    return slip_ ? slip_->NumContacts() : contact_ ? contact_->NumPairs() : 0;
  }

 private:
  std::unique_ptr<HandObjectDistance> distance_;
  std::unique_ptr<Contact> contact_;
  double contact_weight_ = 0.0;
  std::unique_ptr<Slip> slip_;
};

/// Joint limits of the fingers; null when off. `axes` must outlive it.
inline std::unique_ptr<HandPriorTerm> MakeLimits(const HandAxes& axes, const FitOptions& options) {
  if (options.lambda_limits <= 0.0) return nullptr;
  HandPriorWeights weights;
  weights.limits = std::sqrt(options.lambda_limits);
  weights.coupling = weights.neighbors = weights.stay = weights.spread = 0.0;
  return std::make_unique<HandPriorTerm>(axes, HandAngles::Zero(), weights);
}

/// Terms between skin and object that options and object allow, each for one hand and one thread.
using SkinTerms = std::vector<std::pair<EnergyTerm, std::unique_ptr<SkinTerm>>>;

/// `anatomy` and `object` must outlive the result.
inline SkinTerms MakeSkinTerms(const HandAnatomy& anatomy, const FitObject& object,
                               const FitOptions& options) {
  SkinTerms terms;
  if (options.lambda_penetration > 0.0 && object.distance) {
    terms.emplace_back(
        EnergyTerm::kPenetration,
        std::make_unique<Penetration>(anatomy.landmarks, *object.distance, options.soft_tissue_m,
                                      options.lambda_penetration));
  }
  if (options.lambda_object_in_hand > 0.0 && object.surface.cols() > 0) {
    terms.emplace_back(
        EnergyTerm::kObjectInHand,
        std::make_unique<ObjectInHand>(anatomy.hand, object.surface, options.soft_tissue_m,
                                       options.lambda_object_in_hand));
  }
  return terms;
}

}  // namespace holdfast
