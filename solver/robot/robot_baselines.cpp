// SPDX-License-Identifier: MIT
#include "solver/robot/robot_baselines.h"

#include <chrono>
#include <cmath>

#include "geometry/mesh/surface_distance.h"
#include "geometry/rotation.h"
#include "solver/robot/human_demonstration.h"
#include "solver/robot/robot_solver.h"
#include "solver/robot/robot_terms.h"
#include "solver/unknowns/ceres_solve.h"

namespace holdfast {
namespace {

// DexPilot: vectors shorter than this are pulled together, with these weights, to these lengths.
constexpr double kClose_m = 0.03;
constexpr double kPinchWeight = 200.0, kFingersWeight = 400.0;
constexpr double kTaskWeight = 1e4;  // a task error of 1 cm counts as one sigma
constexpr double kPinch_m = 1e-4, kFingersApart_m = 0.03;

Eigen::Vector3d HumanPalm(const RobotTransferSetup& setup, const HumanFrame& frame) {
  return frame.object_from_wrist * setup.wrist_from_root * setup.anatomy.knuckles;
}

RobotVectorTerm FingertipVectors(const RobotKeypoints& keypoints, const HumanFrame& frame,
                                 const Eigen::Vector3d& palm, double scale) {
  const Eigen::Matrix3Xd human = keypoints.HumanTips(frame);
  std::vector<RobotVectorTerm::Pair> pairs;
  for (std::size_t i = 0; i < keypoints.tips.size(); ++i) {
    const auto a = static_cast<Eigen::Index>(i);
    pairs.push_back(
        {keypoints.tips[i], keypoints.palm, scale * (human.col(a) - palm), kTaskWeight});
    for (std::size_t j = i + 1; j < keypoints.tips.size(); ++j) {
      const Eigen::Vector3d vector = human.col(j) - human.col(a);
      const double length = vector.norm();
      const bool thumb = i == 0;
      double weight = kTaskWeight, wanted = scale * length;
      if (length < kClose_m) {
        weight *= thumb ? kPinchWeight : kFingersWeight;
        wanted = thumb ? kPinch_m : kFingersApart_m;
      }
      pairs.push_back(
          {keypoints.tips[j], keypoints.tips[i], wanted / std::max(length, 1e-9) * vector, weight});
    }
  }
  return RobotVectorTerm(std::move(pairs));
}

// Edges whose diametral ball contains no other node.
std::vector<std::vector<int>> GabrielGraph(const Eigen::Matrix3Xd& nodes) {
  std::vector<std::vector<int>> neighbors(static_cast<std::size_t>(nodes.cols()));
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    for (Eigen::Index j = i + 1; j < nodes.cols(); ++j) {
      const Eigen::Vector3d middle = 0.5 * (nodes.col(i) + nodes.col(j));
      const double radius2 = 0.25 * (nodes.col(i) - nodes.col(j)).squaredNorm();
      bool empty = true;
      for (Eigen::Index k = 0; k < nodes.cols() && empty; ++k) {
        empty = k == i || k == j || (nodes.col(k) - middle).squaredNorm() >= radius2;
      }
      if (!empty) continue;
      neighbors[i].push_back(static_cast<int>(j));
      neighbors[j].push_back(static_cast<int>(i));
    }
  }
  return neighbors;
}

double FingerLength(const RobotTransferSetup& setup) {
  double robot = 0.0, human = 0.0;
  for (const RobotFinger& finger : setup.anatomy.fingers) {
    robot += finger.Length();
    const auto& joints = setup.axes->RestJoints();
    human += (joints.col(3 * finger.human) - joints.col(3 * finger.human + 1)).norm() +
             (joints.col(3 * finger.human + 1) - joints.col(3 * finger.human + 2)).norm() +
             (joints.col(3 * finger.human + 2) - setup.axes->RestTips().col(finger.human)).norm();
  }
  return robot / human;
}

// Terms and solver of one frame.
class BaselineFrame {
 public:
  BaselineFrame(const RobotTransferSetup& setup, RobotBaseline baseline)
      : setup_(setup),
        baseline_(baseline),
        keypoints_(setup.robot, setup.anatomy),
        scale_(FingerLength(setup)),
        object_(ContactSamples(setup.object, 0.02, 60)),
        limits_(1e-4),
        walls_(*setup.solids, *setup.object_grid, setup.object_samples, 0.0, 1e-5),
        rest_(setup.robot.Straight(), Eigen::VectorXd::Constant(setup.robot.NumDofs(), 20.0)),
        solver_(setup.robot) {}

  int Solve(const HumanFrame& frame, RobotPose& pose) {
    const Eigen::Isometry3d wrist = frame.object_from_wrist * setup_.wrist_from_root;
    const Eigen::VectorXd sigma = Eigen::VectorXd::Constant(setup_.robot.NumDofs(), 0.5);
    const RobotPostureTerm change(pose.q, sigma);
    const ceres::Solver::Options options = DenseOptions(50, 1e-5, 1e-9);
    const auto solve = [&](const RobotTerm& task, double turn, double way, bool walls) {
      const RobotPlaceTerm place(wrist, setup_.anatomy.knuckles, turn, way);
      std::vector<const RobotTerm*> terms{&task, &place, &limits_, &rest_, &change};
      if (walls) terms.push_back(&walls_);
      return StepsOf(solver_.Solve(terms, options, pose));
    };
    switch (baseline_) {
      case RobotBaseline::kFingertipVectors: {
        pose.R = wrist.linear();
        pose.T = wrist.translation();
        return solve(FingertipVectors(keypoints_, frame, HumanPalm(setup_, frame), scale_), 1e-5,
                     1e-6, false);
      }
      case RobotBaseline::kKeypoints:
        return solve(RobotKeypointTerm(keypoints_.tips, keypoints_.HumanTips(frame), kTaskWeight),
                     0.5, 0.03, false);
      case RobotBaseline::kLaplacian:
        break;
    }
    Eigen::Matrix3Xd human(
        3, 1 + static_cast<Eigen::Index>(keypoints_.joints.size() + keypoints_.tips.size()));
    human << HumanPalm(setup_, frame), keypoints_.HumanJoints(frame), keypoints_.HumanTips(frame);
    std::vector<RobotKeypoint> points{keypoints_.palm};
    points.insert(points.end(), keypoints_.joints.begin(), keypoints_.joints.end());
    points.insert(points.end(), keypoints_.tips.begin(), keypoints_.tips.end());
    Eigen::Matrix3Xd nodes(3, human.cols() + object_.cols());
    nodes << human, object_;
    return solve(RobotLaplacianTerm(points, human, object_, GabrielGraph(nodes), kTaskWeight), 10.0,
                 1.0, true);
  }

 private:
  const RobotTransferSetup& setup_;
  RobotBaseline baseline_;
  RobotKeypoints keypoints_;
  double scale_;
  Eigen::Matrix3Xd object_;
  RobotLimitTerm limits_;
  RobotPenetrationTerm walls_;
  RobotPostureTerm rest_;
  RobotBlock solver_;
};

}  // namespace

RobotTransfer TransferByBaseline(const RobotTransferSetup& setup, RobotBaseline baseline) {
  BaselineFrame solver(setup, baseline);
  RobotTransfer out;
  const auto& frames = setup.demonstration.frames;
  const Eigen::Isometry3d first = frames.front().object_from_wrist * setup.wrist_from_root;
  RobotPose pose{first.linear(), first.translation(),
                 setup.anatomy.open + 0.3 * (setup.anatomy.closed - setup.anatomy.open)};
  const auto begin = std::chrono::steady_clock::now();
  for (const HumanFrame& frame : frames) {
    out.iterations += solver.Solve(frame, pose);
    out.poses.push_back(pose);
  }
  out.solve_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return out;
}

}  // namespace holdfast
