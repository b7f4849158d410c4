// SPDX-License-Identifier: MIT
#include "solver/body_ik/straighten_trunk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include <ceres/manifold.h>
#include <ceres/normal_prior.h>

#include "generator/body/limb_ik.h"
#include "generator/matching/foot_lock.h"
#include "generator/walk_statistics/reach_faults.h"
#include "geometry/rotation.h"
#include "solver/body_ik/frame_pose.h"
#include "solver/terms/body/goal_terms.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

constexpr double kFree = 3.0 * kDegree, kMost = 20.0 * kDegree;
constexpr double kStands = 60.0 * kDegree;  // a larger lean is lying down
constexpr int kEven = 8;                    // frames
constexpr std::array<int, 3> kSpine = {kSpine1, kSpine2, kSpine3};
constexpr std::array<double, 3> kShares = {0.4, 0.35, 0.25};

// Bends the trunk forward so that pelvis-to-neck rotates by `angle`.
void BendForward(const BodyPlacement& placed, double yaw, double angle, BodyFrame& frame) {
  const double height = placed.joints(2, kNeck) - placed.joints(2, kPelvis);
  double moved = 0.0;
  for (std::size_t k = 0; k < kSpine.size(); ++k) {
    moved += kShares[k] * (placed.joints(2, kNeck) - placed.joints(2, kSpine[k])) / height;
  }
  const Eigen::Vector3d left(std::cos(yaw), std::sin(yaw), 0.0);
  const auto turn = [&](int joint, double by) {
    const Eigen::Matrix3d& parent = placed.rotation[kJointParents[joint]];
    const Eigen::Matrix3d turned =
        Eigen::AngleAxisd(by, left) * placed.rotation[static_cast<std::size_t>(joint)];
    frame.local[static_cast<std::size_t>(joint)] =
        Eigen::Quaterniond(Eigen::Matrix3d(parent.transpose() * turned)).normalized();
  };
  for (std::size_t k = 0; k < kSpine.size(); ++k) turn(kSpine[k], kShares[k] * angle / moved);
  turn(kNeck, -angle / moved);
}

}  // namespace

void StraightenTrunk(const Eigen::Matrix3Xd& rest_joints, std::vector<BodyFrame>& frames) {
  const std::vector<BodyPlacement> placed = Place(rest_joints, frames);
  std::vector<double> beyond;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double lean = LeanBack(placed[t], Yaw(frames[t]));
    beyond.push_back(lean < kStands ? std::clamp(lean - kFree, 0.0, kMost) : 0.0);
  }
  const std::vector<double> bends = Envelope(beyond, kEven);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double bend = FadeIn(static_cast<int>(t)) * bends[t];
    if (bend > 0.0) BendForward(placed[t], Yaw(frames[t]), bend, frames[t]);
  }
}

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

// sqrt(1 / weight): resistance of each angle.
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
  constexpr double kMinBend = 3.0 * kDegree, kMaxBend = 150.0 * kDegree;
  constexpr double kSigma_m = 0.005;
  const Limb arm = Arm(side);
  const BodyPlacement at = Place(rest_joints, frame);
  const double lacks = (target - at.joints.col(arm.end)).norm();
  if (lacks < 1e-4) return lacks;
  const UpperBodyChain chain(rest_joints, side);
  const double bend = Bend(at, arm);
  UpperBodyChange change = UpperBodyChange::Zero();
  change(Dofs::kElbow) = std::clamp(0.0, kMinBend - bend, kMaxBend - bend);
  ceres::Problem problem;
  problem.AddResidualBlock(
      new FrameBlock<WristTerms>(chain, frame, {{target, kSigma_m}}, Eigen::VectorXd::Ones(1)),
      nullptr, change.data());
  problem.AddResidualBlock(
      new ceres::NormalPrior(Stiffness().asDiagonal().toDenseMatrix(), UpperBodyChange::Zero()),
      nullptr, change.data());
  problem.SetManifold(change.data(), new ceres::SubsetManifold(
                                         Dofs::kSize, {0, 1, 2, 3, 4, 5, 22, 23, 24, 25, 26, 27}));
  problem.SetParameterLowerBound(change.data(), Dofs::kElbow, kMinBend - bend);
  problem.SetParameterUpperBound(change.data(), Dofs::kElbow, kMaxBend - bend);
  SolveQuietly(DenseOptions(20, 1e-8, 1e-6), problem);
  frame = chain.Changed(frame, change);
  return (target - Place(rest_joints, frame).joints.col(arm.end)).norm();
}

}  // namespace holdfast
