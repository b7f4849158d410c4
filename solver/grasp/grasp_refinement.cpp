// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_refinement.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "solver/terms/hand/hand_prior.h"
#include "solver/terms/hand/penetration.h"
#include "solver/terms/hand/vertex_goals.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/dense_problem.h"

namespace holdfast {
namespace {

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
  SkinPositions(landmarks, hand.At(fingers.data(), false).Vertices(), skin);
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
                                                             const RefinementOptions& options,
                                                             RefinedPoints points) {
  std::vector<std::unique_ptr<ceres::CostFunction>> terms;
  if (!points.watched.empty()) {
    terms.push_back(
        std::make_unique<PenetrationTerm>(hand, object, std::move(points.watched),
                                          PenetrationShape{options.penetration_weight, 0.0}));
  }
  if (!points.touching.empty()) {
    terms.push_back(std::make_unique<GraspContactTerm>(
        hand, object, std::move(points.touching),
        GraspContactShape{options.contact_weight, -options.press_m}));
  }
  if (!points.colliding.empty()) {
    terms.push_back(std::make_unique<FingerCollisionTerm>(
        hand, anatomy.landmarks, std::move(points.colliding), options.collision_weight));
  }
  if (!points.intrusions.empty()) {
    terms.push_back(std::make_unique<IntrusionTerm>(hand, std::move(points.intrusions),
                                                    options.penetration_weight));
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
      points.intrusions =
          find_intrusions(hand.At(fingers.data(), false).Vertices(), wrist_from_object);
    }

    HandPriorWeights weights;
    weights.stay = 0.4;
    weights.spread = 1.0;
    weights.limits = 30.0;
    const HandPriorTerm prior(anatomy.axes, preferred, weights);
    const auto terms = PointTerms(anatomy, hand, object, options, std::move(points));
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
