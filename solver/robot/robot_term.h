// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "solver/robot_hand/robot_kinematics.h"

namespace holdfast {

/// A hand somewhere in the object's frame: x_in_object = R x_in_root + T.
struct RobotPose {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d T = Eigen::Vector3d::Zero();
  Eigen::VectorXd q;

  Eigen::Isometry3d ObjectFromRoot() const;
};

/// The pose evaluated: where links are. Scratch, reused.
class PosedRobot {
 public:
  explicit PosedRobot(const RobotHand& hand) : state_(hand), object_from_link_(hand.links.size()) {}
  void Set(const RobotPose& pose);

  const RobotPose& Pose() const { return pose_; }
  const RobotState& State() const { return state_; }
  const RobotHand& Hand() const { return state_.Hand(); }
  const Eigen::Isometry3d& ObjectFromLink(int link) const {
    return object_from_link_[static_cast<std::size_t>(link)];
  }

 private:
  RobotPose pose_;
  RobotState state_;
  std::vector<Eigen::Isometry3d> object_from_link_;
};

/// Normal equations of a hand's pose: turn (3; R exp(delta)), translation (3), its numbers. All
/// that acts on points of one link sums up to six numbers' worth: a point's motion is linear in the
/// link's twist, so a link costs 6 x 6 + 6, however many points it has, nothing approximated.
class RobotNormal {
 public:
  explicit RobotNormal(const RobotHand& hand);
  /// Empty again, for a hand that is here now (which must outlive what is added).
  void Begin(const PosedRobot& robot);

  /// A point fixed to `link`, now at `x` in the object's frame: gradient and Hessian of the cost by
  /// its position there.
  void AddPoint(int link, const Eigen::Vector3d& x, const Eigen::Vector3d& gradient,
                const Eigen::Matrix3d& hessian);
  /// The same of one residual with this slope.
  void AddPointRow(int link, const Eigen::Vector3d& x, const Eigen::Vector3d& slope,
                   double residual);
  /// A direction fixed to `link`: gradient and Hessian by the turn, an angle vector in the object's
  /// frame.
  void AddTurn(int link, const Eigen::Vector3d& gradient, const Eigen::Matrix3d& hessian);
  /// A residual of two links at one place: `slope` by the way of `first` against `second`.
  void AddBetween(int first, int second, const Eigen::Vector3d& x, const Eigen::Vector3d& slope,
                  double residual);
  /// A residual whose slopes by turn, translation and numbers (6 + dofs) are known as they are.
  void AddRow(const Eigen::VectorXd& row, double residual);
  /// Of the hand's own number k.
  void AddNumber(int k, double gradient, double hessian);
  /// Of turn and translation themselves.
  void AddBase(const Eigen::Matrix<double, 6, 1>& gradient,
               const Eigen::Matrix<double, 6, 6>& hessian);

  /// Adds all up: (6 + dofs) squared, both triangles.
  void Finish(Eigen::Ref<Eigen::MatrixXd> hessian, Eigen::Ref<Eigen::VectorXd> gradient) const;

 private:
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  struct Link {
    bool used = false;
    Vector6d gradient;
    Matrix6d hessian;
  };
  Link& Use(int link);

  const PosedRobot* robot_ = nullptr;
  std::vector<Link> links_;  // twists in the root's frame, angular first
  Eigen::MatrixXd numbers_;  // Hessian of the hand's numbers alone
  Eigen::VectorXd numbers_gradient_;
  Vector6d base_gradient_;
  Matrix6d base_hessian_;
  Eigen::MatrixXd rows_;  // of AddRow
  Eigen::VectorXd rows_gradient_;
  Eigen::VectorXd row_;
};

/// Adds `scale` times the slopes of direction^T x, x the point of `link` that is at `x` (object's
/// frame) now, to a row for AddRow.
void AddPointSlopes(const PosedRobot& robot, int link, const Eigen::Vector3d& x,
                    const Eigen::Vector3d& direction, double scale, Eigen::VectorXd& row);

/// A term of a robot hand's energy.
class RobotTerm {
 public:
  virtual ~RobotTerm() = default;
  /// Half the sum of squares; its derivatives too where `normal` is not null.
  virtual double Add(const PosedRobot& robot, RobotNormal* normal) const = 0;
};

}  // namespace holdfast
