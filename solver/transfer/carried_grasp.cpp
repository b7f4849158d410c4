// SPDX-License-Identifier: MIT
#include "solver/transfer/carried_grasp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/fit/hand_object_block.h"
#include "solver/fit/hold_terms.h"
#include "solver/grasp/grasp_assessment.h"
#include "solver/grasp/grasp_stages.h"
#include "solver/terms/hand/hand_prior.h"
#include "solver/terms/hand/vertex_goals.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/dense_problem.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kFar_m = 0.025;        // skin farther away has no target
constexpr double kFade_m = 0.008;       // weight of farther skin: exp(-(d / fade)^2)
constexpr double kMaxDepth_m = 0.0018;  // of hand and object in each other

// Returns the rigid motion that best aligns weighted points with their goals (Kabsch).
Isometry3d NearestMotion(const Matrix3Xd& points, const Matrix3Xd& goals,
                         const Eigen::VectorXd& weights) {
  const double sum = weights.sum();
  const Vector3d a = points * weights / sum, b = goals * weights / sum;
  const Matrix3Xd off = points.colwise() - a;
  const Eigen::Matrix3d turn =
      NearestRotation((goals.colwise() - b) * weights.asDiagonal() * off.transpose());
  return RigidTransform(turn, b - turn * a);
}

}  // namespace

// Targets of a hand's skin on the second object.
struct GraspCarrier::Goals {
  Matrix3Xd at;             // 3 x N, second object's frame
  Eigen::VectorXd weights;  // N
  std::vector<int> touching;
  std::array<bool, kNumFingers> fingers{};  // in contact on the first object
  Vector3d middle = Vector3d::Zero();       // of the mapped contacts
};

GraspCarrier::Goals GraspCarrier::GoalsOf(const HandOnObject& held) const {
  HandEvaluation evaluation = AtWrist(hand_.from);
  const Matrix3Xd vertices =
      held.wrist_from_object.inverse() * evaluation.At(held.fingers.data(), false).Vertices();
  Goals goals{vertices, Eigen::VectorXd::Zero(vertices.cols()), {}, {}, Vector3d::Zero()};
  for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
    if (first_.fit.distance->Linear(vertices.col(i)) > kFar_m) continue;
    const SignedDistance::Result near = first_.solid.distance.Query(vertices.col(i));
    if (near.distance > kFar_m) continue;
    const SurfaceMap::Image image = map_.At(near.closest, near.gradient);
    goals.at.col(i) = image.point + near.distance * image.normal;
    const double share = std::max(0.0, near.distance) / kFade_m;
    goals.weights(i) = std::exp(-share * share);
    if (near.distance >= kCarriedTouch_m) continue;
    goals.touching.push_back(static_cast<int>(i));
    goals.middle += image.point;
    const int part = hand_.anatomy.landmarks.PartOf(static_cast<int>(i));
    if (part != kPalmPart && near.distance < 0.003) goals.fingers[part / 3] = true;
  }
  if (goals.touching.empty()) {
    throw Error("the clip", "has a hold in which the hand does not touch the object",
                "Fit or refine it first ('holdfast fit', 'holdfast refine')");
  }
  goals.middle /= static_cast<double>(goals.touching.size());
  return goals;
}

// Solves object pose and fingers for the goals, within joint limits; `skin` adds penetration terms.
void GraspCarrier::Minimize(const Goals& goals, double goal_weight, bool skin, int rounds,
                            const HandAngles& preferred, HandOnObject& hold) const {
  HandState state(hand_.to);
  state.SetBody(JointPose::Zero(),
                -hand_.to.Surface().RestJoints().col(WristJoint(hand_.to.HandSide())));
  const VertexGoals term(goals.at, goals.weights, goal_weight);
  HandObjectBlock block(&state);
  block.AddTerm(EnergyTerm::kContact, &term);
  SkinTerms skin_terms;
  if (skin) {
    FitOptions weights;
    weights.soft_tissue_m = 0.0003;
    skin_terms = MakeSkinTerms(hand_.anatomy, second_.fit, weights);
    for (const auto& [kind, skin_term] : skin_terms) block.AddTerm(kind, skin_term.get());
  }
  HandPriorWeights prior_weights;
  prior_weights.limits = 10.0;
  prior_weights.coupling = prior_weights.neighbors = 0.02;
  prior_weights.stay = 0.02;
  prior_weights.spread = 0.05;
  const HandPriorTerm prior(hand_.anatomy.axes, preferred, prior_weights);
  FingerPose fingers = hold.fingers;
  ObjectPose object(hold.wrist_from_object);
  double* const q = object.orientation.coeffs().data();
  double* const T = object.translation.data();
  const double* const now[] = {q, T, fingers.data()};
  DenseProblem problem;
  problem.AddParameterBlock(fingers.data(), kHandDofs);
  problem.AddParameterBlock(q, 4, true);
  problem.AddParameterBlock(T, 3);
  problem.AddResidualBlock(block, {q, T, fingers.data()});
  problem.AddResidualBlock(prior, {fingers.data()});
  block.Watch(now);
  for (int round = 0; round < rounds; ++round) {
    if (!problem.Solve(DenseOptions(30, 1e-5, 1e-6)).IsSolutionUsable()) return;
    if (!block.Watch(now)) break;
  }
  hold.fingers = fingers;
  hold.wrist_from_object = object.Transform();
}

std::vector<Intrusion> GraspCarrier::Intrusions(const Matrix3Xd& vertices,
                                                const Isometry3d& pose) const {
  std::vector<Intrusion> found;
  const Isometry3d object_from_wrist = pose.inverse();
  for (ClosedHands::Inside& in :
       hand_.closed.FindInside(vertices, pose * second_.fit.surface, patches_)) {
    if (in.depth <= 0.0 || std::ranges::max(in.over.corners) >= hand_.to.NumVertices()) continue;
    in.over.point = object_from_wrist * in.over.point;
    found.push_back(in.over);
  }
  return found;
}

void GraspCarrier::PressOn(HandOnObject& hold) const {
  HandEvaluation evaluation = AtWrist(hand_.to);
  HandAngles angles = hand_.anatomy.axes.AnglesOf(hold.fingers);
  RefinementOptions refinement;
  refinement.contact_reach_m = 0.006;
  RefineGrasp(hand_.anatomy, evaluation, *second_.fit.distance, refinement, angles,
              hold.wrist_from_object, [&](const Matrix3Xd& vertices, const Isometry3d& pose) {
                return Intrusions(vertices, pose);
              });
  hold.fingers = hand_.anatomy.axes.PoseOf(angles);
}

double GraspCarrier::ObjectInHand(const Matrix3Xd& vertices, const Isometry3d& pose) const {
  double deepest = 0.0;
  for (const auto& in : hand_.closed.FindInside(vertices, pose * second_.fit.surface, patches_)) {
    deepest = std::max(deepest, in.depth);
  }
  return deepest;
}

CarriedGrasp GraspCarrier::Measured(const Goals& goals, const HandOnObject& hold) const {
  CarriedGrasp carried;
  carried.hold = hold;
  HandEvaluation evaluation = AtWrist(hand_.to);
  const Matrix3Xd vertices = evaluation.At(hold.fingers.data(), false).Vertices();
  const Matrix3Xd in_object = hold.wrist_from_object.inverse() * vertices;
  Matrix3Xd skin;
  SkinPositions(hand_.anatomy.landmarks, in_object, skin);
  const Eigen::VectorXd distance = SkinDistances(hand_.anatomy.landmarks, *second_.fit.distance,
                                                 Isometry3d::Identity(), skin, kCarriedTouch_m);
  carried.hand_in_object_mm = 1e3 * std::max(0.0, -distance.minCoeff());
  carried.object_in_hand_mm = 1e3 * ObjectInHand(vertices, hold.wrist_from_object);
  carried.contacts = static_cast<int>(goals.touching.size());
  for (const int i : goals.touching) {
    carried.contact_off_mm += 1e3 * (in_object.col(i) - goals.at.col(i)).norm();
  }
  carried.contact_off_mm /= carried.contacts;
  std::array<bool, kNumFingers> touching{};
  for (Eigen::Index s = 0; s < skin.cols(); ++s) {
    const int part = hand_.anatomy.landmarks.Skin()[s].part;
    if (part != kPalmPart && distance(s) < 0.0025) touching[part / 3] = true;
  }
  carried.fingers_touching = static_cast<int>(std::ranges::count(touching, true));
  carried.fingers_touched = static_cast<int>(std::ranges::count(goals.fingers, true));
  const double deepest = std::max(carried.hand_in_object_mm, carried.object_in_hand_mm);
  const double overlap = 1e3 * SelfPenetration(hand_.anatomy.landmarks, vertices);
  const int wanted = std::max(1, carried.fingers_touched - 1);
  if (deepest > 1e3 * kMaxDepth_m) {
    carried.refused = fmt::format("hand and object penetrate each other by {:.1f} mm", deepest);
  } else if (overlap > 4.0) {
    carried.refused = fmt::format("fingers penetrate each other by {:.1f} mm", overlap);
  } else if (carried.fingers_touching < wanted) {
    carried.refused = fmt::format("{} fingers touch the object instead of {}",
                                  carried.fingers_touching, carried.fingers_touched);
  } else if (goals.fingers[kThumb] && !touching[kThumb]) {
    carried.refused = "the thumb no longer touches the object";
  }
  carried.clean = carried.refused.empty();
  return carried;
}

// Selects the grasp with the best score minus the cost of its distance from the transferred one.
void GraspCarrier::Search(const Goals& goals, const Vector3d& up_in_wrist,
                          CarriedGrasp& carried) const {
  constexpr double kScoreOfMeter = 8.0, kLever_m = 0.10;
  GraspOptions search;
  search.seed = seed_;
  search.threads = threads_;
  search.table_weight = 0.0;
  search.up_in_wrist = {up_in_wrist};
  const bool near_surface =
      second_.solid.distance.Query(goals.middle).distance > -GraspPlace::kFarthestOff_m;
  const Isometry3d wanted = carried.hold.wrist_from_object.inverse();
  for (const bool at_place : {true, false}) {
    if (at_place && !near_surface) continue;
    search.place.reset();
    if (at_place) {
      GraspPlace::Wanted place;
      place.at = goals.middle;
      if (std::abs(second_.solid.distance.Distance(goals.middle)) > GraspPlace::kFarthestOff_m) {
        place.at = second_.solid.distance.Query(goals.middle).closest;
      }
      search.place = std::make_shared<const GraspPlace>(second_.object.mesh, place);
    }
    GraspReport report;
    CloseHand(hand_.to, second_.object.mesh, second_.solid.distance, *second_.fit.distance, search,
              &report);
    double most = -std::numeric_limits<double>::infinity();
    CarriedGrasp best;
    for (const GraspReport::Candidate& candidate : report.candidates) {
      if (!candidate.refused.empty()) continue;
      const Grasp& grasp = candidate.grasp;
      const Isometry3d wrist = grasp.wrist_from_object.inverse();
      const double way = (wrist.translation() - wanted.translation()).norm() +
                         kLever_m * AngleBetween(wrist.linear(), wanted.linear());
      const double worth = grasp.score - kScoreOfMeter * way;
      if (worth <= most) continue;
      CarriedGrasp found = Measured(goals, {grasp.fingers, grasp.wrist_from_object});
      if (std::max(found.hand_in_object_mm, found.object_in_hand_mm) > 1e3 * kMaxDepth_m) {
        continue;
      }
      most = worth;
      best = std::move(found);
    }
    if (!std::isfinite(most)) continue;
    best.clean = best.searched = true;
    best.refused = carried.refused;
    carried = std::move(best);
    return;
  }
}

CarryingHand::CarryingHand(const HandModel& from_hand, const HandModel& to_hand)
    : from(from_hand), to(to_hand), anatomy(to_hand), axes_from(from_hand), closed(to_hand) {
  if (from.HandSide() != to.HandSide() || from.NumVertices() != to.NumVertices()) {
    throw Error("hands", "are not of the same side and the same body model",
                "Convert the clip to the other model first ('holdfast convert')");
  }
}

GraspCarrier::GraspCarrier(const CarryingHand& hand, const PreparedObject& from_object,
                           const PreparedObject& to_object, const SurfaceMap& map, bool search,
                           std::uint64_t seed, int threads)
    : hand_(hand),
      first_(from_object),
      second_(to_object),
      map_(map),
      search_(search),
      seed_(seed),
      threads_(threads) {
  std::vector<int> all(static_cast<std::size_t>(second_.fit.surface.cols()));
  std::iota(all.begin(), all.end(), 0);
  patches_ = PointPatches(second_.fit.surface, all);
}

CarriedGrasp GraspCarrier::Carry(const HandOnObject& held,
                                 const Eigen::Vector3d& up_in_wrist) const {
  const Goals goals = GoalsOf(held);
  const HandAxes& axes = hand_.anatomy.axes;
  // Start: the unchanged hand, rigidly aligned with its goals.
  HandOnObject hold = held;
  hold.fingers = axes.PoseOf(axes.Clamp(hand_.axes_from.AnglesOf(held.fingers)));
  HandEvaluation evaluation = AtWrist(hand_.to);
  hold.wrist_from_object =
      NearestMotion(goals.at, evaluation.At(hold.fingers.data(), false).Vertices(), goals.weights);
  const HandAngles preferred = axes.Clamp(axes.AnglesOf(hold.fingers));
  Minimize(goals, 300.0, false, 1, preferred, hold);
  Minimize(goals, 30.0, true, 4, preferred, hold);
  PressOn(hold);
  CarriedGrasp carried = Measured(goals, hold);
  if (!carried.clean && search_) Search(goals, up_in_wrist, carried);
  const Isometry3d in_place = held.wrist_from_object * map_.InPlace().inverse();
  const Isometry3d moved = carried.hold.wrist_from_object * in_place.inverse();
  carried.wrist_shift_m =
      (carried.hold.wrist_from_object.inverse().translation() - in_place.inverse().translation())
          .norm();
  carried.wrist_turn_rad = LogSO3(moved.linear()).norm();
  return carried;
}

}  // namespace holdfast
