// SPDX-License-Identifier: MIT
#include "generator/actions/script_poses.h"

#include <numbers>

namespace holdfast {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d Frame(const Vector3d& a, const Vector3d& b) {
  Matrix3d frame;
  frame.col(0) = a.normalized();
  Vector3d across = b - b.dot(frame.col(0)) * frame.col(0);
  if (across.norm() < 1e-6) across = frame.col(0).unitOrthogonal();
  frame.col(1) = across.normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

}  // namespace

Matrix3d AlignAxes(const Vector3d& a, const Vector3d& b, const Vector3d& to_a,
                   const Vector3d& to_b) {
  return Frame(to_a, to_b) * Frame(a, b).transpose();
}

std::vector<Isometry3d> TurnedPoses(const Vector3d& point, const Vector3d& axis,
                                    const Vector3d& place, const Vector3d& direction, int count) {
  const Matrix3d first =
      AlignAxes(axis, axis.unitOrthogonal(), direction, direction.unitOrthogonal());
  std::vector<Isometry3d> poses;
  for (int k = 0; k < count; ++k) {
    const AngleAxisd turn(2.0 * std::numbers::pi * k / count, direction.normalized());
    poses.push_back(PoseAt(turn * first, point, place));
  }
  return poses;
}

std::vector<Isometry3d> UprightPoses(const Vector3d& point, const Vector3d& place, int count,
                                     const std::vector<double>& tilts_rad) {
  std::vector<Matrix3d> leans = {Matrix3d::Identity()};
  for (const double tilt : tilts_rad) {
    for (const double sign : {1.0, -1.0}) {
      leans.push_back(AngleAxisd(sign * tilt, Vector3d::UnitX()).matrix());
      leans.push_back(AngleAxisd(sign * tilt, Vector3d::UnitY()).matrix());
    }
  }
  std::vector<Isometry3d> poses;
  for (const Matrix3d& lean : leans) {
    for (int k = 0; k < count; ++k) {
      const AngleAxisd turn(2.0 * std::numbers::pi * k / count, Vector3d::UnitZ());
      poses.push_back(PoseAt(lean * turn, point, place));
    }
  }
  return poses;
}

}  // namespace holdfast
