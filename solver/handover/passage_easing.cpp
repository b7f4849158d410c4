// SPDX-License-Identifier: MIT
#include "solver/handover/passage_easing.h"

#include <limits>

#include <ceres/loss_function.h>

#include "solver/terms/motion/joint_acceleration.h"
#include "solver/terms/motion/joint_goal.h"
#include "solver/unknowns/sparse_solve.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr double kFollow = 1e-3, kFirmer = 1.6;
constexpr int kRounds = 100;

}  // namespace

Eigen::Matrix3Xd EasedWay(const Eigen::Matrix3Xd& way, const WayEnds& ends,
                          const std::function<bool(int, const Vector3d&)>& is_clear) {
  const auto count = static_cast<int>(way.cols());
  if (count == 0) return way;
  const Vector3d unknown = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  Eigen::Matrix3Xd path(3, count + 4);
  path << ends.two_before.value_or(unknown), ends.before.value_or(unknown), way,
      ends.after.value_or(unknown), ends.two_after.value_or(unknown);
  const auto at = [&](int k) { return path.col(k + 2).data(); };
  ceres::Problem problem;
  std::vector<double> weights(way.cols(), kFollow);
  std::vector<ceres::LossFunctionWrapper*> follow;
  for (int k = 0; k < count; ++k) {
    follow.push_back(new ceres::LossFunctionWrapper(nullptr, ceres::TAKE_OWNERSHIP));
    problem.AddResidualBlock(new JointGoal(way.col(k), 1.0), follow.back(), at(k));
  }
  for (int k = -1; k <= count; ++k) {
    if (path.middleCols<3>(k + 1).hasNaN()) continue;
    problem.AddResidualBlock(new JointAcceleration(1.0, 1.0), nullptr, at(k - 1), at(k), at(k + 1));
  }
  for (const int k : {-2, -1, count, count + 1}) {
    if (problem.HasParameterBlock(at(k))) problem.SetParameterBlockConstant(at(k));
  }
  ceres::Solver::Options options = SparseOptions(10, 1e-12);
  options.initial_trust_region_radius = 1e12;  // linear
  for (int round = 0; round < kRounds; ++round) {
    for (int k = 0; k < count; ++k) {
      follow[k]->Reset(new ceres::ScaledLoss(nullptr, weights[k], ceres::TAKE_OWNERSHIP),
                       ceres::TAKE_OWNERSHIP);
    }
    SolveQuietly(options, problem);
    bool clear = true;
    for (int k = 0; k < count; ++k) {
      if (is_clear(k, path.col(k + 2))) continue;
      clear = false;
      weights[k] *= kFirmer;
    }
    if (clear) return path.middleCols(2, count);
  }
  return way;
}

}  // namespace holdfast
