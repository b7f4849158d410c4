// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Part of an axis, meters.
struct AxisSpan {
  double low, high;
  double Length() const { return high - low; }
  double Middle() const { return 0.5 * (low + high); }
};

/// What is asked of a mesh again and again to tell what it is for; object frame, meters.
struct ObjectShape {
  ObjectShape(const TriangleMesh& its_mesh, const DistanceGrid& its_distance);

  AxisSpan Along(const Eigen::Vector3d& axis) const;

  const TriangleMesh& mesh;  ///< must outlive this, and so must the distances
  const DistanceGrid& object;
  Eigen::Matrix3Xd points;   ///< all over the surface (3 x n)
  Eigen::Vector3d middle;    ///< of them
  Eigen::Vector3d centroid;  ///< of the solid
  Eigen::Matrix3d axes;      ///< of inertia of the surface, the longest first
};

/// What lies between two planes across an axis.
struct ShapeSlice {
  int count = 0;                    ///< points in it
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

/// Cut into `count` slices of the same thickness; `axis` is unit.
ShapeSlices CutIntoSlices(const ObjectShape& shape, const Eigen::Vector3d& axis, int count);

/// The box around an object along the directions that most of its surface faces.
struct ObjectBox {
  Eigen::Matrix3d axes;  ///< the longest side first
  std::array<double, 3> side{};
  double filled = 0.0;  ///< share of its volume
  double square = 0.0;  ///< share of the surface that faces along the axes
};

ObjectBox FindBox(const ObjectShape& shape);

/// Share of the sides (what does not face along the axis) that turning about it leaves in place.
double Roundness(const ObjectShape& shape, const Eigen::Vector3d& axis,
                 const Eigen::Vector3d& middle);

/// Whether the surface is everywhere about as far from its middle.
bool IsBall(const ObjectShape& shape);

/// What can be filled: surface from which straight up is free and every way across is not.
struct ObjectOpening {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double share = 0.0;             ///< of the surface that is inside
  double floor = 0.0, rim = 0.0;  ///< along up, meters
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double radius = 0.0;
  bool Any() const { return share > 0.1 && rim - floor > 0.010; }
};

/// Up where the object stands if it is open there, else where it is open most.
ObjectOpening FindOpening(const ObjectShape& shape);

/// What is beyond a bar at one end, and how far it stands out; meters.
struct BeyondBar {
  double length = 0.0, reach = 0.0;
  int count = 0;                                  ///< points of it
  Eigen::Vector3d off = Eigen::Vector3d::Zero();  ///< the middle of it, from the bar's line

  double Bulk() const { return length < 0.012 ? 0.0 : length + reach; }
};

/// A run of slices that a hand closes around.
struct ObjectBar {
  ShapeSlices slices;
  int first = 0, last = -1;                        ///< of the run
  Eigen::Vector3d line = Eigen::Vector3d::Zero();  ///< of its middle line, at 0 along the axis
  double wide = 0.0;                               ///< mean
  double bend = 0.0;                               ///< how far its middles are from a straight line
  std::array<BeyondBar, 2> ends;                   ///< below, above

  double Length() const { return (last - first + 1) * slices.Step(); }
  AxisSpan Run() const { return {slices.Low(first), slices.Low(last + 1)}; }
  /// Thin between two things that stand out.
  bool Waist() const;
};

/// The longest bar of an object, over all directions: cuts straight across it, since slanting ones
/// make a blade look thick. Without slices where nothing of it is one.
ObjectBar FindBar(const ObjectShape& shape);

}  // namespace holdfast
