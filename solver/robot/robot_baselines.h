// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "solver/robot/human_demonstration.h"
#include "solver/robot/transfer_to_robot.h"

namespace holdfast {

/// Keypoint inverse kinematics: sum_i w_i |x_i - target_i|^2; object's frame, meters, 3 residuals
/// per point. Equals the position cost of Mink's FrameTask for differential IK.
class RobotKeypointTerm final : public RobotTerm {
 public:
  RobotKeypointTerm(std::vector<RobotKeypoint> points, Eigen::Matrix3Xd targets, double weight)
      : points_(std::move(points)), targets_(std::move(targets)), weight_(weight) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector3d x = points_[i].At(robot);
      const Eigen::Vector3d off = x - targets_.col(i);
      cost += 0.5 * weight_ * off.squaredNorm();
      if (normal != nullptr) {
        normal->AddPoint(points_[i].link, x, weight_ * off, weight_ * Eigen::Matrix3d::Identity());
      }
    }
    return cost;
  }

 private:
  std::vector<RobotKeypoint> points_;
  Eigen::Matrix3Xd targets_;
  double weight_;
};

/// Preserves the human's vectors between points of the hand: sum_k s_k |(x_a - x_b) - target_k|^2
/// (DexPilot, Handa et al. 2020, eq. 4; the caller switches s_k and targets). Object's frame.
class RobotVectorTerm final : public RobotTerm {
 public:
  struct Pair {
    RobotKeypoint to, from;
    Eigen::Vector3d target;
    double weight;
  };
  explicit RobotVectorTerm(std::vector<Pair> pairs) : pairs_(std::move(pairs)) {}

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    double cost = 0.0;
    Eigen::VectorXd row;
    for (const Pair& pair : pairs_) {
      const Eigen::Vector3d a = pair.to.At(robot);
      const Eigen::Vector3d b = pair.from.At(robot);
      const double root = std::sqrt(pair.weight);
      const Eigen::Vector3d residual = root * (a - b - pair.target);
      cost += 0.5 * residual.squaredNorm();
      if (normal == nullptr) continue;
      for (int axis = 0; axis < 3; ++axis) {
        row.setZero(6 + robot.Hand().NumDofs());
        AddPointSlopes(robot, pair.to.link, a, Eigen::Vector3d::Unit(axis), root, row);
        AddPointSlopes(robot, pair.from.link, b, Eigen::Vector3d::Unit(axis), -root, row);
        normal->AddRow(row, residual(axis));
      }
    }
    return cost;
  }

 private:
  std::vector<Pair> pairs_;
};

/// Preserves the Laplacian of an interaction mesh (Ho et al. 2010; OmniRetarget, Yang et al. 2025):
///   sum_i w |x_i - mean of its neighbors - delta_i|^2,
/// where delta_i is the Laplacian of the human's mesh. Nodes are points of the hand and fixed
/// points of the object; object points have a Laplacian as well. Object's frame, meters.
class RobotLaplacianTerm final : public RobotTerm {
 public:
  /// Node i < points.size() is points[i]; the following nodes are the columns of `object`. `human`
  /// (3 x points): positions on the human. `neighbors`: by node.
  RobotLaplacianTerm(std::vector<RobotKeypoint> points, const Eigen::Matrix3Xd& human,
                     const Eigen::Matrix3Xd& object, std::vector<std::vector<int>> neighbors,
                     double weight)
      : points_(std::move(points)),
        neighbors_(std::move(neighbors)),
        root_(std::sqrt(weight)),
        nodes_(3, human.cols() + object.cols()) {
    nodes_ << human, object;
    delta_ = Laplacian();
  }

  double Add(const PosedRobot& robot, RobotNormal* normal) const override {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      nodes_.col(i) = points_[i].At(robot);
    }
    const Eigen::Matrix3Xd residual = root_ * (Laplacian() - delta_);
    if (normal != nullptr) {
      Eigen::VectorXd row;
      for (std::size_t i = 0; i < neighbors_.size(); ++i) {
        const double share =
            root_ / static_cast<double>(std::max<std::size_t>(1, neighbors_[i].size()));
        for (int axis = 0; axis < 3; ++axis) {
          row.setZero(6 + robot.Hand().NumDofs());
          const auto add = [&](std::size_t node, double scale) {
            if (node >= points_.size()) return;
            AddPointSlopes(robot, points_[node].link, nodes_.col(node), Eigen::Vector3d::Unit(axis),
                           scale, row);
          };
          add(i, root_);
          for (const int j : neighbors_[i]) add(static_cast<std::size_t>(j), -share);
          if (!row.isZero()) normal->AddRow(row, residual(axis, static_cast<Eigen::Index>(i)));
        }
      }
    }
    return 0.5 * residual.squaredNorm();
  }

 private:
  Eigen::Matrix3Xd Laplacian() const {
    Eigen::Matrix3Xd out = nodes_;
    for (std::size_t i = 0; i < neighbors_.size(); ++i) {
      for (const int j : neighbors_[i]) {
        out.col(i) -= nodes_.col(j) / static_cast<double>(neighbors_[i].size());
      }
    }
    return out;
  }

  std::vector<RobotKeypoint> points_;
  std::vector<std::vector<int>> neighbors_;
  double root_;
  mutable Eigen::Matrix3Xd nodes_;
  Eigen::Matrix3Xd delta_;
};

/// Published transfer methods, reimplemented from their papers for comparison.
enum class RobotBaseline {
  /// Fingertip vectors (DexPilot, Handa et al. 2020, eq. 1-4, with its weights and distances;
  /// vectors scaled by the ratio of finger lengths). The palm is aligned with the human's.
  kFingertipVectors,
  /// Inverse kinematics of fingertips and wrist, as commonly set up with Mink.
  kKeypoints,
  /// Laplacian of an interaction mesh of 21 hand points and 60 object points, without penetration
  /// of the object (OmniRetarget, Yang et al. 2025). Edges: the Gabriel graph, i.e. Delaunay edges
  /// whose diametral ball is empty. Its constraints are penalties here.
  kLaplacian,
};

/// Solves frame by frame, each initialized from the previous frame.
RobotTransfer TransferByBaseline(const RobotTransferSetup& setup, RobotBaseline baseline);

}  // namespace holdfast
