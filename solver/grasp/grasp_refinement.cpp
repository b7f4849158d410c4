// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_refinement.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "solver/terms/hand/finger_collision.h"
#include "solver/terms/hand/grasp_contact.h"
#include "solver/terms/hand/hand_prior.h"
#include "solver/terms/hand/penetration.h"

namespace holdfast {
namespace {

constexpr double kWatchDistance = 0.007;  // skin that could come inside within a round
constexpr double kWatchCollision = 0.006;
constexpr int kPointsPerPad = 3;
constexpr int kPointsPerPalm = 6;

// What the terms of one round act on.
struct RefinedPoints {
  std::vector<SkinPoint> watched;   // near enough to come inside
  std::vector<SkinPoint> touching;  // of the pads, drawn to the surface
  std::vector<HandLandmarks::BallPair> colliding;
};

// The points of each pad that are nearest to the object, by the distances of the skin points.
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
  Eigen::VectorXd distance(skin.cols());
  for (Eigen::Index s = 0; s < skin.cols(); ++s) {
    distance(s) = object.Distance(object_from_wrist * skin.col(s));
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

// Adds what acts on the points: contact and penetration on the object's pose (`q`, `T`) and the
// fingers, collision on the fingers alone.
void AddPointTerms(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                   const RefinementOptions& options, RefinedPoints points, double* q, double* T,
                   double* fingers, ceres::Problem& problem) {
  if (!points.watched.empty()) {
    problem.AddResidualBlock(new PenetrationTerm(hand, object, std::move(points.watched),
                                                 {options.penetration_weight, 0.0}),
                             nullptr, q, T, fingers);
  }
  if (!points.touching.empty()) {
    problem.AddResidualBlock(new GraspContactTerm(hand, object, std::move(points.touching),
                                                  {options.contact_weight, -options.press_m}),
                             nullptr, q, T, fingers);
  }
  if (!points.colliding.empty()) {
    problem.AddResidualBlock(
        new FingerCollisionTerm(hand, anatomy.landmarks, std::move(points.colliding),
                                options.collision_weight),
        nullptr, fingers);
  }
}

// False when the solver fails.
bool SolveRefinement(int iterations, ceres::Problem& problem) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = iterations;
  solver.function_tolerance = 1e-4;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary.IsSolutionUsable();
}

}  // namespace

void RefineGrasp(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                 const RefinementOptions& options, HandAngles& angles,
                 Eigen::Isometry3d& wrist_from_object) {
  const HandAngles preferred = anatomy.axes.Clamp(angles);

  for (int round = 0; round < options.rounds; ++round) {
    FingerPose fingers = anatomy.axes.PoseOf(angles);
    Eigen::Quaterniond rotation(wrist_from_object.linear());
    Eigen::Vector3d translation = wrist_from_object.translation();
    RefinedPoints points =
        ChooseRefinedPoints(anatomy, hand, object, options, fingers, wrist_from_object);

    ceres::Problem problem;
    double* const q = rotation.coeffs().data();
    problem.AddParameterBlock(q, 4, new RotationManifold);
    AddPointTerms(anatomy, hand, object, options, std::move(points), q, translation.data(),
                  fingers.data(), problem);
    HandPriorWeights prior;
    prior.stay = 0.4;
    prior.spread = 1.0;
    prior.limits = 30.0;
    problem.AddResidualBlock(new HandPriorTerm(anatomy.axes, preferred, prior), nullptr,
                             fingers.data());
    if (!SolveRefinement(options.iterations, problem)) return;

    angles = anatomy.axes.Clamp(anatomy.axes.AnglesOf(fingers));
    wrist_from_object = RigidTransform(rotation.normalized().toRotationMatrix(), translation);
  }
}

}  // namespace holdfast
