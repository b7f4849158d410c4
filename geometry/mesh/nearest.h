// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include <Eigen/Core>

namespace holdfast {

/// Exact nearest neighbors among fixed points, by FLANN's single k-d tree in double precision.
/// Const after construction; queries may run on any number of threads.
///
/// Ties are resolved to the lowest id, so the result does not depend on the tree. Distances are
/// meters, not squared.
class NearestPoints {
 public:
  struct Neighbor {
    int id = -1;
    double distance = 0.0;
    bool operator==(const Neighbor&) const = default;
  };

  /// Copies the points (3 x n). Throws Error for no points or coordinates that are not finite.
  explicit NearestPoints(const Eigen::Matrix3Xd& points);
  ~NearestPoints();
  NearestPoints(NearestPoints&&) noexcept;
  NearestPoints& operator=(NearestPoints&&) noexcept;

  /// Returns the nearest point; for a query that is not finite, id -1 at infinite distance.
  Neighbor Nearest(const Eigen::Vector3d& query) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace holdfast
