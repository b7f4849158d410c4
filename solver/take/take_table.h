// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// A small side table: a square top on a column with a round foot. Frame: origin at the center of
/// the top's upper face, z up, edges along x and y.
struct SideTable {
  double height_m = 0.7;      ///< of the upper face above the ground
  double width_m = 0.45;      ///< of the top
  double thickness_m = 0.03;  ///< of the top
  Eigen::Isometry3d world_from_table = Eigen::Isometry3d::Identity();

  /// Touching closed solids: top, column, foot, in the table's frame. A table too low for a column
  /// (its top on the ground) has only the top.
  TriangleMesh Mesh() const;
  /// Signed distance from those solids, world, meters: exact outside, negative inside.
  double Distance(const Eigen::Vector3d& point_world) const;
};

/// Returns the table for an object at `bottom_middle` (whose height is the table's) with edges
/// along `yaw_rad`. The object is `ahead_m` behind the middle of the edge that faces a person
/// looking along `yaw_rad`, and `aside_m` to the left of it.
SideTable TableAt(const Eigen::Vector3d& bottom_middle, double yaw_rad, double ahead_m,
                  double aside_m = 0.0);

/// A table pose for a given object position.
struct TablePlacement {
  SideTable table;
  double deepest_m = 0.0;  ///< depth of the body's points, 0 if clear
};

/// Finds the table that best avoids the points of a moving body (3 x n, world), e.g. its vertices
/// in all frames. Searches yaws within 60 degrees of `yaw_rad` and object positions at least
/// `margin_m` from the edges, those nearest to the person first.
TablePlacement PlaceTable(const Eigen::Vector3d& bottom_middle, double yaw_rad, double margin_m,
                          const Eigen::Matrix3Xd& body_points);

/// Distance from the edges that an object on a table keeps, meters.
double TableMargin(const TriangleMesh& mesh);

/// Returns the skin of these frames (default: all) near a table at `bottom_middle` and less than
/// 2 cm above it: 3 x n, world. `with_arms`: also that of hands and forearms.
Eigen::Matrix3Xd SkinNearTable(const Clip& clip, const BodySurface& surface,
                               const Eigen::Vector3d& bottom_middle, int threads,
                               std::vector<int> frames = {}, bool with_arms = true);

/// Sets Clip::table, with its mesh, to a table that stands still.
void SetTable(const SideTable& table, Clip& clip);

/// Sets Clip::table to a table on which the object of the clip stands in `frames`. It avoids the
/// person's skin, except hands and forearms, in all frames where a placement does; and hands and
/// forearms in the first and in the last frame, unless they rest on it there. KeepOutOfBody keeps
/// them out of it in between.
void AddTable(std::span<const int> frames, const BodySurface& body, const TriangleMesh& object,
              int threads, Clip& clip);

}  // namespace holdfast
