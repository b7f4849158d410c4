// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_stages.h"

#include <algorithm>
#include <span>

namespace holdfast {

GraspStages::GraspStages(const HandModel& hand, const TriangleMesh& object,
                         const DistanceGrid& distance, const GraspOptions& options,
                         const GraspProgress& progress)
    : hand_(hand),
      object_(object),
      distance_(distance),
      options_(options),
      progress_(progress),
      anatomy_(hand),
      placer_(anatomy_),
      scene_(anatomy_, placer_, distance, object, options),
      at_wrist_(AtWrist(hand)) {}

void GraspStages::FindPlaces(int samples, int count, std::uint64_t seed, bool handles) {
  if (handles) {
    const GraspUse use = options_.use.value_or(GraspUse::kHandle);
    if (options_.style.value_or(GraspStyle::kHandle) == GraspStyle::kHandle &&
        (use == GraspUse::kHandle || use == GraspUse::kAny)) {
      scene_.LookForHandles();
    }
    scene_.TakeFor(FindUse(object_, distance_, scene_.handles, options_.use));
    if (!scene_.handles.empty()) handle_placer_.emplace(anatomy_);
  }
  oppositions_.clear();
  if (options_.style != GraspStyle::kHandle) {
    OppositionOptions opposition_options;
    opposition_options.samples = samples;
    opposition_options.count = count;
    opposition_options.seed = seed;
    opposition_options.weight = [&](const Opposition& opposition) {
      return scene_.use.OppositionWeight(opposition.center, opposition.axis);
    };
    if (options_.place) {
      opposition_options.allowed = [&](const Eigen::Vector3d& x) {
        return options_.place->Allows(x);
      };
    }
    oppositions_ = FindOppositions(options_.place ? options_.place->Surface() : object_, distance_,
                                   scene_.held_at, opposition_options);
  }
  double thinnest = std::numeric_limits<double>::infinity();
  for (const Opposition& opposition : oppositions_) thinnest = std::min(thinnest, opposition.width);
  allowed_depth_ = std::clamp(0.2 * thinnest, 0.0005, 0.003);
}

std::vector<Placement> GraspStages::PlaceAt(int place) const {
  const auto handle = place - static_cast<int>(oppositions_.size());
  return handle < 0 ? placer_.Place(oppositions_[place], {distance_, scene_.size, allowed_depth_},
                                    options_.turns)
                    : handle_placer_->Place(scene_.handles, handle, distance_);
}

GraspStages::ClosedHand GraspStages::Close(const Placement& placement,
                                           HandEvaluation& evaluation) const {
  ClosingOptions closing_options;
  closing_options.allowed_depth = std::min(closing_options.allowed_depth, allowed_depth_);
  closing_options.fingers = placement.closing;
  const Closing closing = CloseFingers(anatomy_, evaluation, distance_, placement.wrist_from_object,
                                       placement.start, closing_options);
  return {{placement.style, closing.angles, placement.wrist_from_object, placement.handle},
          closing.finger_touching[kThumb]};
}

std::vector<GraspContact> GraspStages::Contacts(HandEvaluation& evaluation,
                                                const FingerPose& fingers,
                                                const Eigen::Isometry3d& wrist_from_object) const {
  return PadContacts(anatomy_, evaluation, distance_, fingers, wrist_from_object,
                     options_.touch_distance_m);
}

bool GraspStages::Holds(const std::vector<GraspContact>& contacts) const {
  return HoldsGravity(contacts, scene_.centroid, 0.5 * scene_.size, options_.friction);
}

bool GraspStages::HoldsFirmly(const std::vector<GraspContact>& contacts) const {
  constexpr double kSqueeze = 6.0, kOffSqueeze = 12.0, kOffset = 0.1;
  const auto holds = [&](std::span<const Eigen::Vector3d> mass_centers, double squeeze) {
    CertificateOptions certificate_options;
    certificate_options.most_squeeze = squeeze;
    return HoldsGravity(contacts, mass_centers, 0.5 * scene_.size, options_.friction,
                        certificate_options);
  };
  std::vector<Eigen::Vector3d> off;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double way : {-1.0, 1.0}) {
      off.emplace_back(scene_.centroid + way * kOffset * scene_.size * Eigen::Vector3d::Unit(axis));
    }
  }
  return holds({&scene_.centroid, 1}, kSqueeze) && holds(off, kOffSqueeze);
}

GraspCertificate GraspStages::Certify(const std::vector<GraspContact>& contacts) const {
  CertificateOptions certificate_options;
  certificate_options.friction = options_.friction;
  return CertifyContacts(contacts, scene_.centroid, 0.5 * scene_.size, certificate_options);
}

}  // namespace holdfast
