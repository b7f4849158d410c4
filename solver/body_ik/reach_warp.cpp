// SPDX-License-Identifier: MIT
#include "solver/body_ik/reach_warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include <ceres/manifold.h>
#include <ceres/normal_prior.h>
#include <fmt/format.h>

#include "generator/body/limb_ik.h"
#include "generator/matching/foot_lock.h"
#include "generator/scripted/minimum_jerk.h"
#include "generator/walk_statistics/balance.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/body_ik/frame_pose.h"
#include "solver/terms/body/goal_terms.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/change_spline.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

// Fraction of the goal error that is corrected in a frame.
double Share(const ReachWarp& warp, int frame) {
  if (warp.rests && frame >= warp.frame) return 1.0;
  const double tau =
      frame <= warp.frame
          ? static_cast<double>(frame - warp.begin) / std::max(1, warp.frame - 1 - warp.begin)
          : static_cast<double>(warp.end - 1 - frame) / std::max(1, warp.end - 2 - warp.frame);
  return MinimumJerk(tau);
}

class ReachWarpSolver {
 public:
  ReachWarpSolver(const Eigen::Matrix3Xd& rest_joints, const std::vector<FeetTarget>& feet,
                  const ReachWarp& warp, const ReachWarpOptions& options,
                  std::vector<BodyFrame>& frames)
      : chain_(rest_joints, warp.wrist),
        feet_(feet),
        warp_(warp),
        options_(options),
        frames_(frames),
        captured_(frames.begin() + warp.begin, frames.begin() + warp.end),
        change_(warp.end - warp.begin, options.knot_frames),
        over_feet_(WayOverFeet()) {}

  ReachWarpReport Solve() {
    ceres::Problem problem;
    change_.AddTo(problem);
    const BodyPlacement at_goal = Place(chain_.RestJoints(), captured_[warp_.frame - warp_.begin]);
    const Vector3d lacks = warp_.goal - at_goal.joints.col(chain_.WristJointId());
    for (int t = warp_.begin; t < warp_.end; ++t) {
      change_.AddFrame(problem, t - warp_.begin, [&](const Eigen::Vector4d& basis) {
        return new ReachFrameBlock(chain_, Captured(t), TermsOf(t, lacks), basis);
      });
    }
    change_.AddPrior(problem, UpperBodySigma({0.06, 0.06, 0.10}, 7.0 * kDegree, 8.0 * kDegree),
                     0.5);
    change_.HoldStart(problem);
    if (!warp_.rests) change_.HoldEnd(problem);
    const ceres::Solver::Summary summary =
        SolveQuietly(SparseOptions(options_.max_iterations, 1e-4), problem);
    ReachWarpReport report;
    report.iterations = summary.num_successful_steps + summary.num_unsuccessful_steps;
    report.converged = summary.termination_type == ceres::CONVERGENCE;
    if (summary.IsSolutionUsable()) Finish(report);
    return report;
  }

 private:
  const BodyFrame& Captured(int t) const { return captured_[t - warp_.begin]; }

  ReachFrameTerms TermsOf(int t, const Vector3d& lacks) const {
    const BodyFrame& frame = Captured(t);
    const BodyPlacement placed = Place(chain_.RestJoints(), frame);
    const double share = Share(warp_, t);
    const Vector3d wrist = placed.joints.col(chain_.WristJointId());
    ReachFrameTerms terms;
    const bool rests = warp_.rests && t > warp_.frame;
    terms.wrist.target = rests ? warp_.goal : Vector3d(wrist + share * lacks);
    terms.wrist.sigma_m = t == warp_.frame ? options_.goal_sigma_m
                          : rests          ? options_.rest_sigma_m
                                           : options_.path_sigma_m;
    // The face rotates like the direction from the head to the hand's target.
    const Vector3d head = placed.joints.col(15);
    const Vector3d face = placed.rotation[15].col(2);
    const Eigen::Quaterniond turn =
        RotationBetween(warp_.goal - lacks - head, warp_.goal - lacks + share * lacks - head);
    terms.gaze.wanted = turn * face;
    terms.balance.captured = Balance::Middle(chain_, placed);
    if (over_feet_.norm() > 0.0) {
      constexpr int kAround = 15, kStill = 6;  // frames around the arrival; at the end
      constexpr double kSigma_m = 0.01;
      const int from = warp_.frame - kAround;
      const int to = std::max(warp_.frame, std::min(warp_.frame + kAround, warp_.end - kStill));
      const double moved = MinimumJerk(static_cast<double>(t - from) / (to - from));
      terms.balance.captured += moved * over_feet_;
      terms.balance.sigma_m += moved * (kSigma_m - terms.balance.sigma_m);
    }
    terms.legs = LegReach::Of(chain_, placed, feet_[t]);
    terms.range = JointRange::Of(chain_, frame, options_.joint_limits);
    return terms;
  }

  Eigen::Vector2d WayOverFeet() const {
    constexpr double kWithin_m = FootSupport::kFootRadius_m - 0.02;
    if (options_.soles == nullptr || !warp_.rests) return Eigen::Vector2d::Zero();
    const BodyPlacement placed = Place(chain_.RestJoints(), captured_.back());
    const Eigen::Vector2d center = CenterOfMass(placed).head<2>();
    const Eigen::Vector2d way = FootSupport(options_.soles->At(placed)).Nearest(center) - center;
    return std::max(0.0, 1.0 - kWithin_m / std::max(way.norm(), kWithin_m)) * way;
  }

  // Applies the change to the frames, legs included.
  void Finish(ReachWarpReport& report) {
    std::vector<BodyFrame> changed;
    for (int t = warp_.begin; t < warp_.end; ++t) {
      changed.push_back(chain_.Changed(Captured(t), change_.At(t - warp_.begin)));
    }
    for (int t = warp_.begin; t < warp_.end; ++t) {
      BodyFrame& frame = changed[t - warp_.begin];
      report.max_missed_m =
          std::max(report.max_missed_m, PlaceLegs(chain_.RestJoints(), feet_[t], frame));
      frames_[t] = frame;
    }
    const BodyPlacement placed = Place(chain_.RestJoints(), frames_[warp_.frame]);
    report.wrist_error_m = (placed.joints.col(chain_.WristJointId()) - warp_.goal).norm();
  }

  UpperBodyChain chain_;
  const std::vector<FeetTarget>& feet_;
  const ReachWarp& warp_;
  const ReachWarpOptions& options_;
  std::vector<BodyFrame>& frames_;
  std::vector<BodyFrame> captured_;
  ChangeSpline change_;
  Eigen::Vector2d over_feet_;  // way of the resting body's center of mass to its feet
};

}  // namespace

ReachWarpReport WarpReach(const Eigen::Matrix3Xd& rest_joints, const std::vector<FeetTarget>& feet,
                          const ReachWarp& warp, const ReachWarpOptions& options,
                          std::vector<BodyFrame>& frames) {
  const int margin = 3 * options.knot_frames;
  if (warp.begin < 0 || warp.end > static_cast<int>(frames.size()) ||
      warp.frame - warp.begin < margin ||
      (warp.rests ? warp.end <= warp.frame : warp.end - 1 - warp.frame < margin)) {
    throw Error("reach",
                fmt::format("frames [{}, {}) leave no time around frame {}", warp.begin, warp.end,
                            warp.frame),
                fmt::format("Leave {} frames on either side", margin));
  }
  return ReachWarpSolver(rest_joints, feet, warp, options, frames).Solve();
}

namespace {

using Dofs = UpperBodyDofs;

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
