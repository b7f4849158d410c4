// SPDX-License-Identifier: MIT
#include "solver/body_ik/wrist_placement.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <ceres/manifold.h>
#include <ceres/normal_prior.h>

#include "generator/body/limb_ik.h"
#include "geometry/rotation.h"
#include "solver/body_ik/frame_block.h"
#include "solver/terms/body/wrist_goal.h"
#include "solver/unknowns/sparse_solve.h"

namespace holdfast {
namespace {

using Dofs = UpperBodyDofs;
using Eigen::Vector3d;

struct WristTerms {
  WristGoal wrist;
  auto Tied() const { return std::tie(wrist); }
};

double Bend(const BodyPlacement& at, const Limb& arm) {
  const Vector3d upper = at.joints.col(arm.middle) - at.joints.col(arm.root);
  const Vector3d lower = at.joints.col(arm.end) - at.joints.col(arm.middle);
  return std::atan2(upper.cross(lower).norm(), upper.dot(lower));
}

// sqrt(1 / weight): how much each angle resists.
UpperBodyChange Stiffness() {
  UpperBodyChange weight = UpperBodyChange::Ones();
  weight.segment<6>(Dofs::kSpine).setConstant(0.05);
  weight.segment<3>(Dofs::kSpine + 6).setConstant(0.08);
  weight.segment<3>(Dofs::kCollar).setConstant(0.15);
  weight(Dofs::kElbow) = 1.5;
  return weight.cwiseInverse().cwiseSqrt();
}

}  // namespace

double PlaceWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Vector3d& target,
                  BodyFrame& frame) {
  constexpr double kLeastBend = 3.0 * kDegree, kMostBend = 150.0 * kDegree;
  constexpr double kSigma_m = 0.005;
  const Limb arm = Arm(side);
  const BodyPlacement at = Place(rest_joints, frame);
  const double lacks = (target - at.joints.col(arm.end)).norm();
  if (lacks < 1e-4) return lacks;
  const UpperBodyChain chain(rest_joints, side);
  const double bend = Bend(at, arm);
  UpperBodyChange change = UpperBodyChange::Zero();
  change(Dofs::kElbow) = std::clamp(0.0, kLeastBend - bend, kMostBend - bend);
  ceres::Problem problem;
  problem.AddResidualBlock(
      new FrameBlock<WristTerms>(chain, frame, {{target, kSigma_m}}, Eigen::VectorXd::Ones(1)),
      nullptr, change.data());
  problem.AddResidualBlock(
      new ceres::NormalPrior(Stiffness().asDiagonal().toDenseMatrix(), UpperBodyChange::Zero()),
      nullptr, change.data());
  problem.SetManifold(change.data(), new ceres::SubsetManifold(
                                         Dofs::kSize, {0, 1, 2, 3, 4, 5, 22, 23, 24, 25, 26, 27}));
  problem.SetParameterLowerBound(change.data(), Dofs::kElbow, kLeastBend - bend);
  problem.SetParameterUpperBound(change.data(), Dofs::kElbow, kMostBend - bend);
  SolveQuietly(DenseOptions(20, 1e-8, 1e-6), problem);
  frame = chain.Changed(frame, change);
  return (target - Place(rest_joints, frame).joints.col(arm.end)).norm();
}

}  // namespace holdfast
