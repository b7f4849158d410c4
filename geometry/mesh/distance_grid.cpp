// SPDX-License-Identifier: MIT
#include "geometry/mesh/distance_grid.h"

#include <algorithm>
#include <cmath>

#include "geometry/error.h"

namespace holdfast {
namespace {

/// Catmull-Rom weights of four nodes at t in [0, 1] between the middle two.
Eigen::Vector4d Weights(double t) {
  const double t2 = t * t;
  const double t3 = t2 * t;
  return {-0.5 * t + t2 - 0.5 * t3, 1.0 - 2.5 * t2 + 1.5 * t3, 0.5 * t + 2.0 * t2 - 1.5 * t3,
          -0.5 * t2 + 0.5 * t3};
}

Eigen::Vector4d WeightDerivatives(double t) {
  const double t2 = t * t;
  return {-0.5 + 2.0 * t - 1.5 * t2, -5.0 * t + 4.5 * t2, 0.5 + 4.0 * t - 4.5 * t2, -t + 1.5 * t2};
}

}  // namespace

DistanceGrid::DistanceGrid(const SignedDistance& surface, const DistanceGridOptions& options) {
  if (!(options.cell_m > 0.0) || !(options.padding_m > 0.0) || options.max_nodes < 64) {
    throw Error("distance grid", "the cell and the padding must be positive, and nodes 64 or more",
                "Use the defaults: 2 mm cells, 20 mm padding");
  }
  const Eigen::Vector3d low = surface.Min().array() - options.padding_m;
  const Eigen::Vector3d high = surface.Max().array() + options.padding_m;
  cell_ = options.cell_m;
  const auto num_nodes = [&] {
    return (((high - low) / cell_).array().ceil().max(1.0) + 3.0).prod();
  };
  while (num_nodes() > static_cast<double>(options.max_nodes)) cell_ *= 1.05;
  inverse_cell_ = 1.0 / cell_;
  cells_ = ((high - low) / cell_).array().ceil().max(1.0).cast<int>();
  min_ = low;
  max_ = low + cell_ * cells_.cast<double>();

  const Eigen::Vector3i nodes = cells_.array() + 3;
  stride_y_ = nodes.x();
  stride_z_ = stride_y_ * nodes.y();
  values_.resize(static_cast<std::size_t>(stride_z_) * nodes.z());
  Eigen::Matrix3Xd slab(3, stride_z_);
  for (int k = 0; k < nodes.z(); ++k) {
    // There and back along x: each node lies beside the one before, whose nearest face is the hint.
    Eigen::Index n = 0;
    for (int j = 0; j < nodes.y(); ++j) {
      for (int i = 0; i < nodes.x(); ++i) {
        const int x = j % 2 == 0 ? i : nodes.x() - 1 - i;
        slab.col(n++) = min_ + cell_ * Eigen::Vector3d(x - 1, j - 1, k - 1);
      }
    }
    const Eigen::VectorXd distances = surface.Distances(slab, options.threads);
    double* out = values_.data() + k * stride_z_;
    for (int j = 0; j < nodes.y(); ++j) {
      for (int i = 0; i < nodes.x(); ++i) {
        const int x = j % 2 == 0 ? i : nodes.x() - 1 - i;
        out[j * stride_y_ + x] = distances[j * stride_y_ + i];
      }
    }
  }
}

double DistanceGrid::Interpolate(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const {
  const Eigen::Vector3d local = (point - min_) * inverse_cell_;
  int cell[3];
  Eigen::Vector4d weight[3];
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = std::clamp(static_cast<int>(local[axis]), 0, cells_[axis] - 1);
    weight[axis] = Weights(local[axis] - cell[axis]);
  }
  const double* corner = values_.data() + cell[2] * stride_z_ + cell[1] * stride_y_ + cell[0];
  if (gradient == nullptr) {
    double value = 0.0;
    for (int k = 0; k < 4; ++k) {
      double plane = 0.0;
      for (int j = 0; j < 4; ++j) {
        const Eigen::Map<const Eigen::Vector4d> row(corner + k * stride_z_ + j * stride_y_);
        plane += weight[1][j] * weight[0].dot(row);
      }
      value += weight[2][k] * plane;
    }
    return value;
  }
  Eigen::Vector4d slope[3];
  for (int axis = 0; axis < 3; ++axis) slope[axis] = WeightDerivatives(local[axis] - cell[axis]);
  double value = 0.0;
  gradient->setZero();
  for (int k = 0; k < 4; ++k) {
    double plane = 0.0;
    double plane_dx = 0.0;
    double plane_dy = 0.0;
    for (int j = 0; j < 4; ++j) {
      const Eigen::Map<const Eigen::Vector4d> row(corner + k * stride_z_ + j * stride_y_);
      const double along_x = weight[0].dot(row);
      plane += weight[1][j] * along_x;
      plane_dx += weight[1][j] * slope[0].dot(row);
      plane_dy += slope[1][j] * along_x;
    }
    value += weight[2][k] * plane;
    (*gradient)[0] += weight[2][k] * plane_dx;
    (*gradient)[1] += weight[2][k] * plane_dy;
    (*gradient)[2] += slope[2][k] * plane;
  }
  *gradient *= inverse_cell_;
  return value;
}

double DistanceGrid::Distance(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const {
  const Eigen::Vector3d nearest = point.cwiseMax(min_).cwiseMin(max_);
  const double at_box = Interpolate(nearest, gradient);
  const Eigen::Vector3d outside = point - nearest;
  const double squared_gap = outside.squaredNorm();
  if (!(squared_gap > 0.0)) return at_box;
  const double distance = std::sqrt(at_box * at_box + squared_gap);
  if (gradient != nullptr) {
    // `nearest` moves with the point only along the axes it was not clamped on.
    for (int axis = 0; axis < 3; ++axis) {
      (*gradient)[axis] =
          (outside[axis] != 0.0 ? outside[axis] : at_box * (*gradient)[axis]) / distance;
    }
  }
  return distance;
}

}  // namespace holdfast
