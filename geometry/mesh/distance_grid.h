// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "geometry/isa.h"
#include "geometry/mesh/signed_distance.h"

namespace holdfast {

struct DistanceGridOptions {
  double cell_m = 0.002;  ///< edge of a cell; creases of the distance are rounded over two of them
  double padding_m = 0.02;  ///< how far the grid reaches beyond the bounding box of the surface
  int threads = 1;          ///< for building; the same bytes for any number
  Isa isa = BestIsa();      ///< of queries; the same bits for any that the machine supports
  std::size_t max_nodes = 20'000'000;  ///< 8 bytes each: cells grow rather than exceed them
};

/// A signed distance sampled on a regular grid, for use inside solvers: tricubic (Catmull-Rom)
/// interpolation, value and gradient continuous inside the box, about 30 ns per query, no
/// allocation. The gradient is the exact derivative of the value returned (not of the true
/// distance, and not quite unit).
///
/// Outside the box, with q the nearest point of the box: sqrt(distance(q)^2 + |p - q|^2), a lower
/// bound of the true distance (the angle at q between p and any point of the surface is obtuse),
/// continuous but with a kink at the box.
///
/// Const after construction; queries may run on any number of threads.
class DistanceGrid {
 public:
  /// Samples `surface` at every node. Throws Error for a cell or padding that is not positive.
  explicit DistanceGrid(const SignedDistance& surface, const DistanceGridOptions& options = {});

  /// Signed distance in metres, negative inside; its gradient too when `gradient` is not null.
  double Distance(const Eigen::Vector3d& point, Eigen::Vector3d* gradient = nullptr) const;

  double CellSize() const { return cell_; }            ///< metres
  const Eigen::Vector3d& Min() const { return min_; }  ///< corners of the box that is interpolated
  const Eigen::Vector3d& Max() const { return max_; }
  std::size_t NumNodes() const { return values_.size(); }

 private:
  double Interpolate(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const;

  double cell_ = 0.0;
  double inverse_cell_ = 0.0;
  Eigen::Vector3d min_, max_;
  Eigen::Vector3i cells_;  // per axis
  bool avx_ = false;       // whether queries use it
  // Nodes at min_ + cell_ * (i - 1), x fastest: one ring more than the cells have corners.
  std::vector<double> values_;
  std::ptrdiff_t stride_y_ = 0, stride_z_ = 0;
};

}  // namespace holdfast
