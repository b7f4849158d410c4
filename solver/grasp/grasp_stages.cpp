// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_stages.h"

#include <algorithm>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "solver/terms/hand/hand_prior.h"
#include "solver/terms/hand/penetration.h"
#include "solver/terms/hand/vertex_goals.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/dense_problem.h"

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
      scene_.handles = FindHandles(distance_, options_.threads);
      std::erase_if(scene_.handles, [&](const Handle& handle) {
        return options_.place && !options_.place->Allows(handle.bar);
      });
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

std::pair<GraspAttempt, bool> GraspStages::Close(const Placement& placement,
                                                 HandEvaluation& evaluation) const {
  const Closing closing =
      CloseFingers(anatomy_, evaluation, distance_, placement.wrist_from_object, placement.start,
                   placement.closing, std::min(kClosingDepth_m, allowed_depth_));
  return {
      GraspAttempt{placement.style, closing.angles, placement.wrist_from_object, placement.handle},
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
    return HoldsGravity(contacts, mass_centers, 0.5 * scene_.size, options_.friction,
                        {.most_squeeze = squeeze});
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
  return CertifyContacts(contacts, scene_.centroid, 0.5 * scene_.size,
                         {.friction = options_.friction});
}

namespace {

constexpr double kPushOut = 3000.0;       // weight of penetration, per meter
constexpr double kAttract = 300.0;        // weight of contact, per meter
constexpr double kFingersApart = 1500.0;  // weight of collisions of fingers, per meter
constexpr double kPress_m = 0.0004;       // target penetration of pads
constexpr double kWatchDistance = 0.007;  // skin that could penetrate within a round
constexpr double kWatchCollision = 0.006;
constexpr int kPointsPerPad = 3;
constexpr int kPointsPerPalm = 6;

// Points that the terms of one round act on.
struct RefinedPoints {
  std::vector<SkinPoint> watched;   // near enough to penetrate
  std::vector<SkinPoint> touching;  // of the pads, attracted to the surface
  std::vector<HandLandmarks::BallPair> colliding;
  std::vector<Intrusion> intrusions;
};

// Selects the points of each pad nearest to the object, from the distances of the skin points.
std::vector<SkinPoint> NearestOfPads(const HandLandmarks& landmarks,
                                     const Eigen::VectorXd& distance, double reach) {
  std::vector<SkinPoint> touching;
  for (int part = 0; part < kNumHandParts; ++part) {
    std::vector<std::pair<double, int>> nearest;
    for (const int i : landmarks.Pad(part)) {
      if (distance(i) < reach) nearest.emplace_back(distance(i), i);
    }
    const std::size_t count =
        std::min<std::size_t>(nearest.size(), part == kPalmPart ? kPointsPerPalm : kPointsPerPad);
    std::partial_sort(nearest.begin(), nearest.begin() + count, nearest.end());
    for (std::size_t n = 0; n < count; ++n) {
      touching.push_back({nearest[n].second, nearest[n].second, part});
    }
  }
  return touching;
}

RefinedPoints ChooseRefinedPoints(const HandAnatomy& anatomy, HandEvaluation& hand,
                                  const DistanceGrid& object, const RefinementOptions& options,
                                  const FingerPose& fingers,
                                  const Eigen::Isometry3d& wrist_from_object) {
  const HandLandmarks& landmarks = anatomy.landmarks;
  RefinedPoints points;
  const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
  Eigen::Matrix3Xd skin;
  SkinPositions(landmarks, hand.At(fingers).Vertices(), skin);
  const Eigen::VectorXd distance = SkinDistances(landmarks, object, object_from_wrist, skin,
                                                 std::max(kWatchDistance, options.contact_reach_m));
  for (Eigen::Index s = 0; s < skin.cols(); ++s) {
    if (distance(s) < kWatchDistance) points.watched.push_back(landmarks.Skin()[s]);
  }
  points.touching = NearestOfPads(landmarks, distance, options.contact_reach_m);
  Eigen::Matrix3Xd centers;
  BallCenters(landmarks, skin.leftCols(anatomy.hand.NumVertices()), centers);
  for (const HandLandmarks::BallPair& pair : landmarks.BallPairs()) {
    if ((centers.col(pair.first) - centers.col(pair.second)).norm() <
        pair.free_distance + kWatchCollision) {
      points.colliding.push_back(pair);
    }
  }
  return points;
}

// Terms on the points: contact and penetration depend on object pose and fingers, collision on the
// fingers only.
std::vector<std::unique_ptr<ceres::CostFunction>> PointTerms(const HandAnatomy& anatomy,
                                                             HandEvaluation& hand,
                                                             const DistanceGrid& object,
                                                             RefinedPoints points) {
  std::vector<std::unique_ptr<ceres::CostFunction>> terms;
  if (!points.watched.empty()) {
    terms.push_back(std::make_unique<PenetrationTerm>(hand, object, std::move(points.watched),
                                                      PenetrationShape{kPushOut, 0.0}));
  }
  if (!points.touching.empty()) {
    terms.push_back(std::make_unique<GraspContactTerm>(hand, object, std::move(points.touching),
                                                       GraspContactShape{kAttract, -kPress_m}));
  }
  if (!points.colliding.empty()) {
    terms.push_back(std::make_unique<FingerCollisionTerm>(
        hand, anatomy.landmarks, std::move(points.colliding), kFingersApart));
  }
  if (!points.intrusions.empty()) {
    terms.push_back(std::make_unique<IntrusionTerm>(hand, std::move(points.intrusions), kPushOut));
  }
  return terms;
}

}  // namespace

void RefineGrasp(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                 const RefinementOptions& options, HandAngles& angles,
                 Eigen::Isometry3d& wrist_from_object, const FindIntrusions& find_intrusions) {
  const HandAngles preferred = anatomy.axes.Clamp(angles);

  for (int round = 0; round < options.rounds; ++round) {
    FingerPose fingers = anatomy.axes.PoseOf(angles);
    Eigen::Quaterniond rotation(wrist_from_object.linear());
    Eigen::Vector3d translation = wrist_from_object.translation();
    RefinedPoints points =
        ChooseRefinedPoints(anatomy, hand, object, options, fingers, wrist_from_object);
    if (find_intrusions) {
      points.intrusions = find_intrusions(hand.At(fingers).Vertices(), wrist_from_object);
    }

    HandPriorWeights weights;
    weights.stay = 0.4;
    weights.spread = 1.0;
    weights.limits = 30.0;
    const HandPriorTerm prior(anatomy.axes, preferred, weights);
    const auto terms = PointTerms(anatomy, hand, object, std::move(points));
    DenseProblem problem;
    double* const q = rotation.coeffs().data();
    problem.AddParameterBlock(fingers.data(), kHandDofs);
    problem.AddParameterBlock(q, 4, true);
    problem.AddParameterBlock(translation.data(), 3);
    problem.AddResidualBlock(prior, {fingers.data()});
    for (const auto& term : terms) {
      if (term->parameter_block_sizes().size() == 1) {
        problem.AddResidualBlock(*term, {fingers.data()});
      } else {
        problem.AddResidualBlock(*term, {q, translation.data(), fingers.data()});
      }
    }
    if (!problem.Solve(DenseOptions(options.iterations, 1e-8, 1e-4)).IsSolutionUsable()) return;

    angles = anatomy.axes.Clamp(anatomy.axes.AnglesOf(fingers));
    wrist_from_object = RigidTransform(rotation.normalized().toRotationMatrix(), translation);
  }
}

}  // namespace holdfast
