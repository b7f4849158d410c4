// SPDX-License-Identifier: MIT
#include "solver/robot/robot_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include <Eigen/Geometry>

#include "geometry/rotation.h"
#include "solver/robot/robot_measures.h"
#include "solver/unknowns/rotation_manifold.h"

namespace holdfast {

RobotBlock::RobotBlock(const RobotHand& hand) : robot_(hand), normal_(hand) {
  const int n = 6 + hand.NumDofs();
  set_num_residuals(n + 1);
  *mutable_parameter_block_sizes() = {4, 3, hand.NumDofs()};
  rows_residuals_.resize(n + 1);
}

double RobotBlock::Linearize(const RobotPose& pose, Eigen::MatrixXd& hessian,
                             Eigen::VectorXd& gradient) const {
  const Eigen::Index n = 6 + robot_.Hand().NumDofs();
  hessian.resize(n, n);
  gradient.resize(n);
  robot_.Set(pose);
  normal_.Begin(robot_);
  double cost = 0.0;
  for (const RobotTerm* term : terms_) cost += term->Add(robot_, &normal_);
  normal_.Finish(hessian, gradient);
  return cost;
}

bool RobotBlock::Evaluate(double const* const* parameters, double* residuals,
                          double** jacobians) const {
  const Eigen::Index n = num_residuals() - 1;
  pose_.R = Eigen::Map<const Eigen::Quaterniond>(parameters[0]).toRotationMatrix();
  pose_.T = Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  pose_.q = Eigen::Map<const Eigen::VectorXd>(parameters[2], n - 6);
  Eigen::Map<Eigen::VectorXd> r(residuals, n + 1);
  if (jacobians == nullptr) {
    robot_.Set(pose_);
    double cost = 0.0;
    for (const RobotTerm* term : terms_) cost += term->Add(robot_, nullptr);
    r.setZero();
    r(0) = std::sqrt(2.0 * cost);
    return std::isfinite(cost);
  }
  const double cost = Linearize(pose_, hessian_, gradient_);
  if (!std::isfinite(cost)) return false;
  CompressNormalEquations(hessian_, gradient_, cost, rows_, rows_residuals_);
  r = rows_residuals_;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>> J(jacobians[0], n + 1, 4);
    J.topRows(n) = RotationManifold::Lift(rows_.leftCols<3>(), parameters[0]);
    J.row(n).setZero();
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>> J(jacobians[1], n + 1, 3);
    J << rows_.middleCols<3>(3), Eigen::RowVector3d::Zero();
  }
  if (jacobians[2] != nullptr) {
    Eigen::Map<RowMajorMatrix> J(jacobians[2], n + 1, n - 6);
    J << rows_.rightCols(n - 6), Eigen::RowVectorXd::Zero(n - 6);
  }
  return true;
}

ceres::Solver::Summary RobotBlock::Solve(const std::vector<const RobotTerm*>& terms,
                                         const ceres::Solver::Options& options, RobotPose& pose) {
  SetTerms(terms);
  Eigen::Quaterniond turn(pose.R);
  Eigen::Vector3d T = pose.T;
  Eigen::VectorXd q = pose.q;
  DenseProblem problem;
  problem.AddParameterBlock(turn.coeffs().data(), 4, true);
  problem.AddParameterBlock(T.data(), 3);
  problem.AddParameterBlock(q.data(), robot_.Hand().NumDofs());
  problem.AddResidualBlock(*this, {turn.coeffs().data(), T.data(), q.data()});
  const ceres::Solver::Summary summary = problem.Solve(options);
  pose = {turn.toRotationMatrix(), T, robot_.Hand().Clamped(q)};
  return summary;
}

Eigen::Isometry3d WristFromRoot(const HandAxes& axes, const RobotAnatomy& anatomy) {
  Eigen::Matrix3d wrist_from_axes;
  wrist_from_axes << axes.Forward(), axes.Across(), axes.PalmNormal();
  Eigen::Vector3d knuckles = Eigen::Vector3d::Zero();
  int fingers = 0;
  for (const RobotFinger& finger : anatomy.fingers) {
    if (finger.human == kThumb) continue;
    knuckles += axes.RestJoints().col(3 * finger.human);
    ++fingers;
  }
  knuckles /= fingers;
  return PoseAt(wrist_from_axes * anatomy.root_from_axes.transpose(), anatomy.knuckles, knuckles);
}

std::vector<RobotPose> RobotStarts(const HumanFrame& frame,
                                   const Eigen::Isometry3d& wrist_from_root,
                                   const RobotAnatomy& anatomy) {
  constexpr std::array<double, 3> kBent = {0.15, 0.45, 0.75};
  constexpr std::array<double, 3> kTilts = {0.0, 25.0 * kDegree, -25.0 * kDegree};
  constexpr std::array<double, 2> kBack_m = {0.0, 0.03};
  const Eigen::Isometry3d laid = frame.object_from_wrist * wrist_from_root;
  std::vector<RobotPose> starts;
  for (const double bent : kBent) {
    const Eigen::VectorXd q = anatomy.open + bent * (anatomy.closed - anatomy.open);
    for (const double back : kBack_m) {
      for (int axis = 0; axis < 3; ++axis) {
        for (const double tilt : kTilts) {
          if (tilt == 0.0 && axis > 0) continue;
          const Eigen::Matrix3d turn =
              Eigen::AngleAxisd(tilt, anatomy.root_from_axes.col(axis)).toRotationMatrix();
          const Eigen::Vector3d place = anatomy.knuckles - back * anatomy.root_from_axes.col(2);
          const Eigen::Isometry3d pose = laid * PoseAt(turn, anatomy.knuckles, place);
          starts.push_back({pose.linear(), pose.translation(), q});
        }
      }
    }
  }
  return starts;
}

std::vector<RobotPose> ContactStarts(const RobotTransferSetup& setup, const HumanFrame& frame) {
  constexpr std::array<double, 5> kBent = {0.05, 0.25, 0.45, 0.65, 0.85};
  constexpr int kRounds = 10;
  constexpr double kNormal_m = 0.03;  // length of the normals as segments that are laid together
  const RobotAnatomy& anatomy = setup.anatomy;
  std::vector<RobotPose> starts;
  for (const double bent : kBent) {
    PosedRobot posed(setup.robot);
    posed.Set({Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(),
               anatomy.open + bent * (anatomy.closed - anatomy.open)});
    for (int round = 0; round < kRounds; ++round) {
      Eigen::Matrix3Xd from(3, 2 * std::ssize(frame.contacts)), to(from);
      Eigen::Index ends = 0;
      for (const PartContact& contact : frame.contacts) {
        double cost = 0.0;
        const std::optional<PadPoint> pad =
            round == 0 ? setup.pads.Middle(contact.part, posed)
                       : setup.pads.BestFacing(contact.part, posed, contact.point, contact.normal,
                                               1.0, kNormal_m * kNormal_m, &cost);
        if (!pad) continue;
        const Eigen::Isometry3d& pose = posed.ObjectFromLink(pad->link);
        for (const double along : {0.0, kNormal_m}) {
          from.col(ends) = pose * (pad->point + along * pad->normal);
          to.col(ends++) = contact.point - along * contact.normal;
        }
      }
      if (ends == 0) return {};
      const Eigen::Isometry3d moved(Eigen::umeyama(from.leftCols(ends), to.leftCols(ends), false));
      const Eigen::Isometry3d there = moved * posed.Pose().ObjectFromRoot();
      posed.Set({there.linear(), there.translation(), posed.Pose().q});
    }
    starts.push_back(posed.Pose());
  }
  return starts;
}

int ChooseStart(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                const std::vector<double>& costs) {
  constexpr double kMaxCost = 3.0;  // times the minimum
  constexpr double kGive_m = 0.02;  // doubles the cost
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return costs[k]; });
  PosedRobot posed(setup.robot);
  std::size_t best = order.front();
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t k : order) {
    if (costs[k] > kMaxCost * costs[order.front()] || costs[k] >= least) break;
    posed.Set(poses[k]);
    const double cost = costs[k] * (1.0 + GiveInRobot_m(setup, posed) / kGive_m);
    if (cost >= least) continue;
    least = cost;
    best = k;
  }
  return static_cast<int>(best);
}

}  // namespace holdfast
