// SPDX-License-Identifier: MIT
#include "solver/robot/robot_term.h"

#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Derivatives of slope^T x by the twist of the link that the point x (object's frame) is fixed to:
// a point at p in the root's frame moves by w x p + v.
Eigen::Matrix<double, 6, 1> SlopesOf(const PosedRobot& robot, const Eigen::Vector3d& x,
                                     const Eigen::Vector3d& slope) {
  const Eigen::Matrix3d& R = robot.Pose().R;
  const Eigen::Vector3d p = R.transpose() * (x - robot.Pose().T);
  const Eigen::Vector3d n = R.transpose() * slope;
  Eigen::Matrix<double, 6, 1> slopes;
  slopes << p.cross(n), n;
  return slopes;
}

}  // namespace

Eigen::Isometry3d RobotPose::ObjectFromRoot() const { return RigidTransform(R, T); }

void PosedRobot::Set(const RobotPose& pose) {
  pose_ = pose;
  state_.Evaluate(pose.q);
  const Eigen::Isometry3d object_from_root = pose.ObjectFromRoot();
  for (std::size_t k = 0; k < object_from_link_.size(); ++k) {
    object_from_link_[k] = object_from_root * state_.RootFromLink(static_cast<int>(k));
  }
}

RobotNormal::RobotNormal(const RobotHand& hand)
    : links_(hand.links.size()),
      numbers_(hand.NumDofs(), hand.NumDofs()),
      numbers_gradient_(hand.NumDofs()),
      rows_(6 + hand.NumDofs(), 6 + hand.NumDofs()),
      rows_gradient_(6 + hand.NumDofs()),
      row_(hand.NumDofs()) {}

void RobotNormal::Begin(const PosedRobot& robot) {
  robot_ = &robot;
  for (Link& link : links_) link.used = false;
  numbers_.setZero();
  numbers_gradient_.setZero();
  base_gradient_.setZero();
  base_hessian_.setZero();
  rows_.setZero();
  rows_gradient_.setZero();
}

RobotNormal::Link& RobotNormal::Use(int link) {
  Link& sums = links_[link];
  if (!sums.used) {
    sums.used = true;
    sums.gradient.setZero();
    sums.hessian.setZero();
  }
  return sums;
}

// A point at p moves by w x p + v.
void RobotNormal::AddPoint(int link, const Eigen::Vector3d& x, const Eigen::Vector3d& gradient,
                           const Eigen::Matrix3d& hessian) {
  const Eigen::Matrix3d& R = robot_->Pose().R;
  const Eigen::Vector3d p = R.transpose() * (x - robot_->Pose().T);
  const Eigen::Vector3d g = R.transpose() * gradient;
  const Eigen::Matrix3d H = R.transpose() * hessian * R;
  const Eigen::Matrix3d P = Skew(p);
  Link& sums = Use(link);
  sums.gradient.head<3>() += p.cross(g);
  sums.gradient.tail<3>() += g;
  const Eigen::Matrix3d PH = P * H;
  sums.hessian.topLeftCorner<3, 3>() -= PH * P;
  sums.hessian.topRightCorner<3, 3>() += PH;
  sums.hessian.bottomLeftCorner<3, 3>() += PH.transpose();
  sums.hessian.bottomRightCorner<3, 3>() += H;
}

void RobotNormal::AddPointRow(int link, const Eigen::Vector3d& x, const Eigen::Vector3d& slope,
                              double residual) {
  const Vector6d row = SlopesOf(*robot_, x, slope);
  Link& sums = Use(link);
  sums.gradient += residual * row;
  sums.hessian.noalias() += row * row.transpose();
}

void RobotNormal::AddTurn(int link, const Eigen::Vector3d& gradient,
                          const Eigen::Matrix3d& hessian) {
  const Eigen::Matrix3d& R = robot_->Pose().R;
  Link& sums = Use(link);
  sums.gradient.head<3>() += R.transpose() * gradient;
  sums.hessian.topLeftCorner<3, 3>() += R.transpose() * hessian * R;
}

void RobotNormal::AddBetween(int first, int second, const Eigen::Vector3d& x,
                             const Eigen::Vector3d& slope, double residual) {
  const Vector6d row = SlopesOf(*robot_, x, slope);
  row_.setZero();
  const RobotState& state = robot_->State();
  for (const int joint : state.Chain(first)) {
    row_(state.ColumnOf(joint).dof) += row.dot(state.ColumnOf(joint).twist);
  }
  for (const int joint : state.Chain(second)) {
    row_(state.ColumnOf(joint).dof) -= row.dot(state.ColumnOf(joint).twist);
  }
  numbers_gradient_ += residual * row_;
  numbers_.noalias() += row_ * row_.transpose();
}

void RobotNormal::AddRow(const Eigen::VectorXd& row, double residual) {
  rows_gradient_ += residual * row;
  rows_.noalias() += row * row.transpose();
}

void AddPointSlopes(const PosedRobot& robot, int link, const Eigen::Vector3d& x,
                    const Eigen::Vector3d& direction, double scale, Eigen::VectorXd& row) {
  const Eigen::Matrix<double, 6, 1> slopes = SlopesOf(robot, x, direction);
  const Eigen::Vector3d turn = slopes.head<3>(), n = slopes.tail<3>();
  row.head<3>() += scale * turn;
  row.segment<3>(3) += scale * direction;
  for (const int joint : robot.State().Chain(link)) {
    const RobotState::Column& column = robot.State().ColumnOf(joint);
    row(6 + column.dof) +=
        scale * (turn.dot(column.twist.head<3>()) + n.dot(column.twist.tail<3>()));
  }
}

void RobotNormal::AddNumber(int k, double gradient, double hessian) {
  numbers_gradient_(k) += gradient;
  numbers_(k, k) += hessian;
}

void RobotNormal::AddBase(const Vector6d& gradient, const Matrix6d& hessian) {
  base_gradient_ += gradient;
  base_hessian_ += hessian;
}

void RobotNormal::Finish(Eigen::Ref<Eigen::MatrixXd> hessian,
                         Eigen::Ref<Eigen::VectorXd> gradient) const {
  const Eigen::Index n = numbers_gradient_.size();
  hessian.setZero();
  gradient.head<6>() = base_gradient_;
  gradient.tail(n) = numbers_gradient_;
  hessian.topLeftCorner<6, 6>() = base_hessian_;
  hessian.bottomRightCorner(n, n) = numbers_;
  // Rotating the root by delta and moving it by dT gives all links the twist (delta, R^T dT).
  const Eigen::Matrix3d& R = robot_->Pose().R;
  Matrix6d twist_of_base = Matrix6d::Identity();
  twist_of_base.bottomRightCorner<3, 3>() = R.transpose();
  Vector6d whole_gradient = Vector6d::Zero();
  Matrix6d whole = Matrix6d::Zero();
  const RobotState& state = robot_->State();
  for (std::size_t k = 0; k < links_.size(); ++k) {
    const Link& link = links_[k];
    if (!link.used) continue;
    whole_gradient += link.gradient;
    whole += link.hessian;
    const std::vector<int>& chain = state.Chain(static_cast<int>(k));
    for (const int a : chain) {
      const RobotState::Column& column = state.ColumnOf(a);
      const Vector6d Ht = link.hessian * column.twist;
      gradient(6 + column.dof) += link.gradient.dot(column.twist);
      hessian.block<6, 1>(0, 6 + column.dof) += twist_of_base.transpose() * Ht;
      for (const int b : chain) {
        hessian(6 + state.ColumnOf(b).dof, 6 + column.dof) += Ht.dot(state.ColumnOf(b).twist);
      }
    }
  }
  gradient.head<6>() += twist_of_base.transpose() * whole_gradient;
  hessian.topLeftCorner<6, 6>() += twist_of_base.transpose() * whole * twist_of_base;
  hessian.bottomLeftCorner(n, 6) = hessian.topRightCorner(6, n).transpose();
  hessian += rows_;
  gradient += rows_gradient_;
}

}  // namespace holdfast
