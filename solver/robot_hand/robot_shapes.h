// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Closed meshes of the primitives that robots are made of, about the origin; metres. Cylinders and
/// capsules stand along z, `length` without a capsule's ends.
TriangleMesh BoxMesh(const Eigen::Vector3d& size);
TriangleMesh BallMesh(double radius);
TriangleMesh CylinderMesh(double radius, double length);
TriangleMesh CapsuleMesh(double radius, double length);
/// An ellipsoid with these semi-axes.
TriangleMesh EllipsoidMesh(const Eigen::Vector3d& semi_axes);

/// Throws Error (`source`) unless the numbers of a link's shape are finite, above zero (`length` of
/// a capsule may be zero) and below 100 m.
void RequireShapeSize(const std::string& source, const std::string& link,
                      const Eigen::Ref<const Eigen::VectorXd>& sizes);

/// The mesh with its vertices moved; faces turn where the transform mirrors.
TriangleMesh Transformed(const TriangleMesh& mesh, const Eigen::Affine3d& transform);

/// Where a robot's file at `robot` means the mesh `name` to be: beside it, or for package:// in the
/// nearest folder above that has it. Throws Error where it is not.
std::filesystem::path FindRobotMesh(const std::filesystem::path& robot, const std::string& name);

}  // namespace holdfast
