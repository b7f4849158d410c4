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

constexpr double kWatchDistance = 0.010;  // skin that could come inside within a round
constexpr double kWatchCollision = 0.006;
constexpr int kPointsPerPad = 3;
constexpr int kPointsPerPalm = 6;

}  // namespace

void RefineGrasp(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                 const RefinementOptions& options, HandAngles& angles,
                 Eigen::Isometry3d& wrist_from_object) {
  const HandLandmarks& landmarks = anatomy.landmarks;
  const HandAngles preferred = anatomy.axes.Clamp(angles);

  for (int round = 0; round < options.rounds; ++round) {
    FingerPose fingers = anatomy.axes.PoseOf(angles);
    Eigen::Quaterniond rotation(wrist_from_object.linear());
    Eigen::Vector3d translation = wrist_from_object.translation();

    const Eigen::Isometry3d object_from_wrist = wrist_from_object.inverse();
    Eigen::Matrix3Xd skin;
    SkinPositions(landmarks, hand.At(fingers.data(), false).Vertices(), skin);
    Eigen::VectorXd distance(skin.cols());
    std::vector<SkinPoint> watched;
    for (Eigen::Index s = 0; s < skin.cols(); ++s) {
      distance(s) = object.Distance(object_from_wrist * skin.col(s));
      if (distance(s) < kWatchDistance) watched.push_back(landmarks.Skin()[s]);
    }
    std::vector<SkinPoint> touching;
    for (int part = 0; part < kNumHandParts; ++part) {
      std::vector<std::pair<double, int>> nearest;
      for (const int i : landmarks.Pad(part)) {
        if (distance(i) < options.contact_reach_m) nearest.emplace_back(distance(i), i);
      }
      const std::size_t count =
          std::min<std::size_t>(nearest.size(), part == kPalmPart ? kPointsPerPalm : kPointsPerPad);
      std::partial_sort(nearest.begin(), nearest.begin() + count, nearest.end());
      for (std::size_t n = 0; n < count; ++n) {
        touching.push_back({nearest[n].second, nearest[n].second, part});
      }
    }
    std::vector<HandLandmarks::BallPair> colliding;
    Eigen::Matrix3Xd centers;
    BallCenters(landmarks, skin.leftCols(anatomy.hand.NumVertices()), centers);
    for (const HandLandmarks::BallPair& pair : landmarks.BallPairs()) {
      if ((centers.col(pair.first) - centers.col(pair.second)).norm() <
          pair.free_distance + kWatchCollision) {
        colliding.push_back(pair);
      }
    }

    ceres::Problem problem;
    double* const q = rotation.coeffs().data();
    double* const T = translation.data();
    problem.AddParameterBlock(q, 4, new RotationManifold);
    if (!watched.empty()) {
      problem.AddResidualBlock(
          new PenetrationTerm(hand, object, std::move(watched), {options.penetration_weight, 0.0}),
          nullptr, q, T, fingers.data());
    }
    if (!touching.empty()) {
      problem.AddResidualBlock(new GraspContactTerm(hand, object, std::move(touching),
                                                    {options.contact_weight, -options.press_m}),
                               nullptr, q, T, fingers.data());
    }
    if (!colliding.empty()) {
      problem.AddResidualBlock(
          new FingerCollisionTerm(hand, landmarks, std::move(colliding), options.collision_weight),
          nullptr, fingers.data());
    }
    HandPriorWeights prior;
    prior.stay = 0.4;
    prior.spread = 1.0;
    prior.limits = 30.0;
    problem.AddResidualBlock(new HandPriorTerm(anatomy.axes, preferred, prior), nullptr,
                             fingers.data());

    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    solver.max_num_iterations = options.iterations;
    solver.function_tolerance = 1e-4;
    solver.num_threads = 1;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    if (!summary.IsSolutionUsable()) return;

    angles = anatomy.axes.Clamp(anatomy.axes.AnglesOf(fingers));
    wrist_from_object.linear() = rotation.normalized().toRotationMatrix();
    wrist_from_object.translation() = translation;
  }
}

}  // namespace holdfast
