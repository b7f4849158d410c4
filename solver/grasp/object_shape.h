// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include <Eigen/Core>

#include "geometry/mesh/distance_grid.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// Part of an axis, metres.
struct AxisSpan {
  double low, high;
  double Length() const { return high - low; }
  double Middle() const { return 0.5 * (low + high); }
};

/// What is asked of a mesh again and again to tell what it is for; object frame, metres.
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

}  // namespace holdfast
