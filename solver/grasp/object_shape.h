// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Interval on an axis, meters.
struct AxisSpan {
  double low, high;
  double Length() const { return high - low; }
  double Middle() const { return 0.5 * (low + high); }
};

/// Precomputed properties of a mesh for inferring its use; object frame, meters.
struct ObjectShape {
  ObjectShape(const TriangleMesh& its_mesh, const DistanceGrid& its_distance);

  AxisSpan Along(const Eigen::Vector3d& axis) const;

  const TriangleMesh& mesh;  ///< must outlive this, like the distances
  const DistanceGrid& object;
  Eigen::Matrix3Xd points;   ///< sampled over the surface (3 x n)
  Eigen::Vector3d middle;    ///< mean of `points`
  Eigen::Vector3d centroid;  ///< of the solid
  Eigen::Matrix3d axes;      ///< principal axes of the surface, longest first
};

/// Part of a shape between two planes across an axis.
struct ShapeSlice {
  int count = 0;                    ///< points in the slice
  double narrow = 0.0, wide = 0.0;  ///< least and largest width across the axis
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
};

struct ShapeSlices {
  Eigen::Vector3d axis;
  AxisSpan span;
  std::vector<ShapeSlice> at;

  double Step() const { return span.Length() / static_cast<double>(at.size()); }
  double Low(int k) const { return span.low + k * Step(); }
  int Of(double s) const {
    return std::clamp(static_cast<int>((s - span.low) / Step()), 0,
                      static_cast<int>(at.size()) - 1);
  }
};

/// Cuts a shape into `count` slices of equal thickness; `axis` is unit.
ShapeSlices CutIntoSlices(const ObjectShape& shape, const Eigen::Vector3d& axis, int count);

/// Bounding box of an object along its dominant surface normals.
struct ObjectBox {
  Eigen::Matrix3d axes;  ///< longest side first
  std::array<double, 3> side{};
  double filled = 0.0;  ///< fraction of its volume
  double square = 0.0;  ///< fraction of the surface that faces along the axes
};

ObjectBox FindBox(const ObjectShape& shape);

/// Fraction of the lateral surface (not facing along the axis) that rotation about it preserves.
double Roundness(const ObjectShape& shape, const Eigen::Vector3d& axis,
                 const Eigen::Vector3d& middle);

/// Whether the distance of the surface from its center is nearly constant.
bool IsBall(const ObjectShape& shape);

/// A cavity that can be filled: surface with free space straight up and none to any side.
struct ObjectOpening {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double share = 0.0;             ///< fraction of the surface that is inside
  double floor = 0.0, rim = 0.0;  ///< along up, meters
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double radius = 0.0;
  bool Any() const { return share > 0.1 && rim - floor > 0.010; }
};

/// Finds the opening along z if the object is open there, else the largest opening.
ObjectOpening FindOpening(const ObjectShape& shape);

/// What lies beyond one end of a bar, and how far it protrudes; meters.
struct BeyondBar {
  double length = 0.0, reach = 0.0;
  int count = 0;                                  ///< points of it
  Eigen::Vector3d off = Eigen::Vector3d::Zero();  ///< its mean offset from the bar's line

  double Bulk() const { return length < 0.012 ? 0.0 : length + reach; }
};

/// A run of slices that a hand closes around.
struct ObjectBar {
  ShapeSlices slices;
  int first = 0, last = -1;                        ///< of the run
  Eigen::Vector3d line = Eigen::Vector3d::Zero();  ///< its center line, at 0 along the axis
  double wide = 0.0;                               ///< mean
  double bend = 0.0;                               ///< maximum deviation from `line`
  std::array<BeyondBar, 2> ends;                   ///< below, above

  double Length() const { return (last - first + 1) * slices.Step(); }
  AxisSpan Run() const { return {slices.Low(first), slices.Low(last + 1)}; }
  /// Thin between two parts that protrude.
  bool Waist() const;
};

/// Finds the longest bar of an object over all directions. Only cuts straight across a bar count,
/// since oblique cuts make a blade look thick. Returns no slices if there is no bar.
ObjectBar FindBar(const ObjectShape& shape);

}  // namespace holdfast
