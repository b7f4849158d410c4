// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/robot/robot_kinematics.h"

namespace holdfast {

/// A hand pose in the object's frame: x_in_object = R x_in_root + T.
struct RobotPose {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d T = Eigen::Vector3d::Zero();
  Eigen::VectorXd q;

  Eigen::Isometry3d ObjectFromRoot() const;
};

/// Forward kinematics of a RobotPose. Scratch object, reused.
class PosedRobot {
 public:
  explicit PosedRobot(const RobotHand& hand) : state_(hand), object_from_link_(hand.links.size()) {}
  void Set(const RobotPose& pose);

  const RobotPose& Pose() const { return pose_; }
  const RobotState& State() const { return state_; }
  const RobotHand& Hand() const { return state_.Hand(); }
  const Eigen::Isometry3d& ObjectFromLink(int link) const { return object_from_link_[link]; }

 private:
  RobotPose pose_;
  RobotState state_;
  std::vector<Eigen::Isometry3d> object_from_link_;
};

/// Normal equations of a hand pose: rotation (3; R exp(delta)), translation (3), joints. A point's
/// motion is linear in its link's twist, so all terms on points of a link sum exactly to 6 x 6 + 6
/// numbers, independent of the number of points.
class RobotNormal {
 public:
  explicit RobotNormal(const RobotHand& hand);
  /// Resets to zero for the hand at its current pose (which must outlive the additions).
  void Begin(const PosedRobot& robot);

  /// Adds a point fixed to `link`, currently at `x` in the object's frame: gradient and Hessian of
  /// the cost with respect to its position.
  void AddPoint(int link, const Eigen::Vector3d& x, const Eigen::Vector3d& gradient,
                const Eigen::Matrix3d& hessian);
  /// Adds a point with a single residual of this slope.
  void AddPointRow(int link, const Eigen::Vector3d& x, const Eigen::Vector3d& slope,
                   double residual);
  /// Adds a direction fixed to `link`: gradient and Hessian with respect to rotation, an angle
  /// vector in the object's frame.
  void AddTurn(int link, const Eigen::Vector3d& gradient, const Eigen::Matrix3d& hessian);
  /// Adds a residual of two links at `x`: `slope` by the motion of `first` relative to `second`.
  void AddBetween(int first, int second, const Eigen::Vector3d& x, const Eigen::Vector3d& slope,
                  double residual);
  /// Adds a residual with given slopes by rotation, translation and joints (6 + dofs).
  void AddRow(const Eigen::VectorXd& row, double residual);
  /// Adds derivatives with respect to the hand's joint value k.
  void AddNumber(int k, double gradient, double hessian);
  /// Adds derivatives with respect to rotation and translation.
  void AddBase(const Eigen::Matrix<double, 6, 1>& gradient,
               const Eigen::Matrix<double, 6, 6>& hessian);

  /// Assembles the sum: (6 + dofs) squared, both triangles.
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
  Eigen::MatrixXd numbers_;  // Hessian of the joint values alone
  Eigen::VectorXd numbers_gradient_;
  Vector6d base_gradient_;
  Matrix6d base_hessian_;
  Eigen::MatrixXd rows_;  // of AddRow
  Eigen::VectorXd rows_gradient_;
  Eigen::VectorXd row_;
};

/// Adds `scale` times the derivatives of direction^T x to a row for AddRow, where x is the point of
/// `link` that is currently at `x` (object's frame).
void AddPointSlopes(const PosedRobot& robot, int link, const Eigen::Vector3d& x,
                    const Eigen::Vector3d& direction, double scale, Eigen::VectorXd& row);

/// A term of a robot hand's energy.
class RobotTerm {
 public:
  virtual ~RobotTerm() = default;
  /// Returns half the sum of squares; adds its derivatives if `normal` is not null.
  virtual double Add(const PosedRobot& robot, RobotNormal* normal) const = 0;
};

}  // namespace holdfast
