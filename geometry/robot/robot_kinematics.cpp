// SPDX-License-Identifier: MIT
#include "geometry/robot/robot_kinematics.h"

#include <cassert>
#include <cmath>
#include <numbers>
#include <system_error>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/mesh/convex_hull.h"

namespace holdfast {

RobotState::RobotState(const RobotHand& hand)
    : hand_(&hand),
      root_from_link_(hand.links.size(), Eigen::Isometry3d::Identity()),
      chains_(hand.links.size()),
      columns_(hand.links.size()) {
  for (std::size_t k = 0; k < hand.links.size(); ++k) {
    const RobotLink& link = hand.links[k];
    assert(link.parent < static_cast<int>(k));
    if (link.parent >= 0) chains_[k] = chains_[link.parent];
    columns_[k].dof = link.dof;
    if (link.dof >= 0) chains_[k].push_back(static_cast<int>(k));
  }
}

void RobotState::Evaluate(const Eigen::Ref<const Eigen::VectorXd>& q) {
  assert(q.size() == hand_->NumDofs());
  for (std::size_t k = 0; k < hand_->links.size(); ++k) {
    const RobotLink& link = hand_->links[k];
    Eigen::Isometry3d& pose = root_from_link_[k];
    pose = link.parent < 0 ? link.parent_from_joint
                           : root_from_link_[link.parent] * link.parent_from_joint;
    const double value = link.offset + (link.dof < 0 ? 0.0 : link.factor * q(link.dof));
    const Eigen::Vector3d axis = pose.linear() * link.axis;
    if (link.dof >= 0) {
      auto& twist = columns_[k].twist;
      const bool turns = link.kind == RobotJointKind::kTurning;
      twist.head<3>() = turns ? Eigen::Vector3d(link.factor * axis) : Eigen::Vector3d::Zero();
      twist.tail<3>() = turns ? Eigen::Vector3d(link.factor * pose.translation().cross(axis))
                              : Eigen::Vector3d(link.factor * axis);
    }
    if (value == 0.0) continue;
    if (link.kind == RobotJointKind::kSliding) {
      pose.translation() += value * axis;
    } else {
      pose.linear() = pose.linear() * Eigen::AngleAxisd(value, link.axis).toRotationMatrix();
    }
  }
}

Eigen::Matrix3Xd RobotState::PointJacobian(int link, const Eigen::Vector3d& point) const {
  Eigen::Matrix3Xd J = Eigen::Matrix3Xd::Zero(3, hand_->NumDofs());
  for (const int joint : Chain(link)) {
    const Column& column = ColumnOf(joint);
    J.col(column.dof) += column.twist.head<3>().cross(point) + column.twist.tail<3>();
  }
  return J;
}

namespace {

namespace fs = std::filesystem;

constexpr int kAround = 24, kRings = 12;

Eigen::Vector3d OnBall(int ring, int around) {
  const double polar = std::numbers::pi * ring / kRings;
  const double turn = 2.0 * std::numbers::pi * around / kAround;
  return {std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)};
}

}  // namespace

TriangleMesh BoxMesh(const Eigen::Vector3d& size) {
  Eigen::Matrix3Xd corners(3, 8);
  for (int k = 0; k < 8; ++k) {
    const Eigen::Vector3d sign(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
    corners.col(k) = sign.cwiseProduct(size);
  }
  return ConvexHull(corners);
}

TriangleMesh EllipsoidMesh(const Eigen::Vector3d& semi_axes) {
  Eigen::Matrix3Xd points(3, (kRings - 1) * kAround + 2);
  Eigen::Index n = 0;
  points.col(n++) = semi_axes.cwiseProduct(Eigen::Vector3d::UnitZ());
  points.col(n++) = -semi_axes.cwiseProduct(Eigen::Vector3d::UnitZ());
  for (int ring = 1; ring < kRings; ++ring) {
    for (int k = 0; k < kAround; ++k) points.col(n++) = semi_axes.cwiseProduct(OnBall(ring, k));
  }
  return ConvexHull(points);
}

TriangleMesh BallMesh(double radius) { return EllipsoidMesh(Eigen::Vector3d::Constant(radius)); }

TriangleMesh CylinderMesh(double radius, double length) {
  Eigen::Matrix3Xd points(3, 2 * kAround);
  for (int k = 0; k < kAround; ++k) {
    const Eigen::Vector3d rim = radius * OnBall(kRings / 2, k);
    points.col(2 * k) = rim + 0.5 * length * Eigen::Vector3d::UnitZ();
    points.col(2 * k + 1) = rim - 0.5 * length * Eigen::Vector3d::UnitZ();
  }
  return ConvexHull(points);
}

TriangleMesh CapsuleMesh(double radius, double length) {
  Eigen::Matrix3Xd points(3, 2 * (kRings + 1) * kAround);
  Eigen::Index n = 0;
  for (int ring = 0; ring <= kRings; ++ring) {
    for (int k = 0; k < kAround; ++k) {
      const Eigen::Vector3d ball = radius * OnBall(ring, k);
      points.col(n++) = ball + 0.5 * length * Eigen::Vector3d::UnitZ();
      points.col(n++) = ball - 0.5 * length * Eigen::Vector3d::UnitZ();
    }
  }
  return ConvexHull(points);
}

void RequireShapeSize(const std::string& source, const std::string& link,
                      const Eigen::Ref<const Eigen::VectorXd>& sizes) {
  constexpr double kMaxSize_m = 100.0;
  for (const double size : sizes) {
    if (size > 0.0 && size < kMaxSize_m) continue;
    throw Error(source, fmt::format("link '{}' has a shape of size {:.4g} m", link, size),
                "Give its shapes sizes above 0, in meters");
  }
}

TriangleMesh Transformed(const TriangleMesh& mesh, const Eigen::Affine3d& transform) {
  TriangleMesh moved{transform * mesh.vertices, mesh.faces};
  if (transform.linear().determinant() < 0.0) moved.faces.row(1).swap(moved.faces.row(2));
  return moved;
}

fs::path FindRobotMesh(const fs::path& robot, const std::string& name) {
  const fs::path folder = fs::absolute(robot).parent_path();
  const std::string package = "package://", file = "file://";
  std::error_code ignored;
  if (name.starts_with(package)) {
    const fs::path inside = name.substr(package.size());
    fs::path without_name;
    for (auto part = std::next(inside.begin(), inside.empty() ? 0 : 1); part != inside.end();
         ++part) {
      without_name /= *part;
    }
    for (fs::path up = folder;; up = up.parent_path()) {
      for (const fs::path& tried : {up / inside, up / without_name}) {
        if (fs::is_regular_file(tried, ignored)) return tried;
      }
      if (up == up.parent_path()) break;
    }
  } else {
    const fs::path tried = folder / (name.starts_with(file) ? name.substr(file.size()) : name);
    if (fs::is_regular_file(tried, ignored)) return tried;
  }
  throw Error(robot.string(), fmt::format("its mesh '{}' is missing", name),
              "Put the mesh at that path, relative to the robot's file, or correct the name");
}

}  // namespace holdfast
