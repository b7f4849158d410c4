// SPDX-License-Identifier: MIT
#include "geometry/score/object_pose_error.h"

#include <numbers>
#include <utility>

#include "geometry/rotation.h"
#include "geometry/score/object_shape.h"

namespace holdfast {

ObjectPoseComparer::ObjectPoseComparer(const TriangleMesh& mesh, ObjectSymmetry symmetry)
    : vertices_(mesh.vertices),
      symmetry_(std::move(symmetry)),
      nearest_(mesh.vertices),
      diameter_m_(Diameter(mesh.vertices)) {}

ObjectPoseError ObjectPoseComparer::Compare(
    const Eigen::Isometry3d& world_from_object,
    const Eigen::Isometry3d& reference_world_from_object) const {
  ObjectPoseError error;
  const Eigen::Isometry3d& a = world_from_object;
  const Eigen::Isometry3d& b = reference_world_from_object;
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  error.translation_mm = 1e3 * (a * symmetry_.center - b * symmetry_.center).norm();
  error.rotation_deg = kDegrees * AngleBetween(a.linear(), b.linear());
  error.rotation_modulo_deg = kDegrees * AngleModulo(a.linear(), b.linear(), symmetry_);
  // Distances in the reference's object frame, where the tree of its vertices stays as it is.
  const Eigen::Isometry3d reference_from_object = b.inverse() * a;
  const Eigen::Matrix3Xd moved =
      (reference_from_object.linear() * vertices_).colwise() + reference_from_object.translation();
  error.add_mm = 1e3 * (moved - vertices_).colwise().norm().mean();
  for (const auto& point : moved.colwise()) error.add_s_mm += nearest_.Nearest(point).distance;
  error.add_s_mm *= 1e3 / static_cast<double>(vertices_.cols());
  return error;
}

}  // namespace holdfast
