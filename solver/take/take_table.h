// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A small side table: a square top on one column with a round foot. Its frame: origin in the
/// middle of the top's upper face, z up, edges along x and y.
struct SideTable {
  double height_m = 0.7;      ///< of the upper face above the ground
  double width_m = 0.45;      ///< of the top
  double thickness_m = 0.03;  ///< of the top
  Eigen::Isometry3d world_from_table = Eigen::Isometry3d::Identity();

  /// Closed solids that touch: top, column, foot. In the table's frame. A table too low for a
  /// column (its top on the ground) is the top alone.
  TriangleMesh Mesh() const;
  /// Signed distance from those solids, world, meters: exact outside, negative inside.
  double Distance(const Eigen::Vector3d& point_world) const;
};

/// The table on which an object stands at `bottom_middle` (its height is the table's), its edges
/// along `yaw_rad`, the object `ahead_m` beyond the middle of the edge that faces a person who
/// looks along `yaw_rad`, and `aside_m` to the left of it.
SideTable TableAt(const Eigen::Vector3d& bottom_middle, double yaw_rad, double ahead_m,
                  double aside_m = 0.0);

/// The pose of the table is free; the place of the object on it is given.
struct TablePlacement {
  SideTable table;
  double deepest_m = 0.0;  ///< of the body's points, 0 when clear
};

/// The table that keeps clearest of points that a body passes through (3 x n, world), such as its
/// vertices in all frames: yaws within 60 degrees of `yaw_rad` and places of the object on it, no
/// nearer to an edge than `margin_m`, nearest to the person first.
TablePlacement PlaceTable(const Eigen::Vector3d& bottom_middle, double yaw_rad, double margin_m,
                          const Eigen::Matrix3Xd& body_points);

}  // namespace holdfast
