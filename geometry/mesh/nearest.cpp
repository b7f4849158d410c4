// SPDX-License-Identifier: MIT
#include "geometry/mesh/nearest.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <flann/flann.hpp>

#include "geometry/error.h"

namespace holdfast {
namespace {

using Neighbor = NearestPoints::Neighbor;
using Index = flann::KDTreeSingleIndex<flann::L2_3D<double>>;

constexpr int kLeafSize = 10;

/// Squared search radius that makes FLANN find all points at `distance`. FLANN prunes on sums that
/// may be off by a few ulps; the slack ensures that no tie is missed.
double SearchLimit(double distance) {
  constexpr double kSlack = 1.0 + 1e-12;
  return std::max(distance * distance * kSlack, std::numeric_limits<double>::min());
}

/// Result set that keeps the first neighbor by (distance, id), without allocation.
class First final : public flann::ResultSet<double> {
 public:
  bool full() const override { return best.id >= 0; }

  void addPoint(double squared_distance, std::size_t index) override {
    const Neighbor candidate{static_cast<int>(index), std::sqrt(squared_distance)};
    if (best.id < 0 || candidate.distance < best.distance ||
        (candidate.distance == best.distance && candidate.id < best.id)) {
      best = candidate;
    }
  }

  double worstDist() const override { return SearchLimit(best.distance); }

  Neighbor best{-1, std::numeric_limits<double>::infinity()};
};

}  // namespace

struct NearestPoints::Impl {
  explicit Impl(const Eigen::Matrix3Xd& points_in)
      : points(points_in),
        // Not reordered: FLANN then searches our copy of the points instead of making its own.
        index(flann::Matrix<double>(points.data(), points.cols(), 3),
              flann::KDTreeSingleIndexParams(kLeafSize, false)) {
    index.buildIndex();
  }

  Eigen::Matrix3Xd points;
  Index index;
};

NearestPoints::NearestPoints(const Eigen::Matrix3Xd& points) {
  if (points.cols() == 0) {
    throw Error("nearest points", "there are no points to search", "Give at least one point.");
  }
  if (points.cols() > std::numeric_limits<int>::max()) {
    throw Error("nearest points", "more than 2^31 - 1 points", "Search a part of them.");
  }
  if (!points.allFinite()) {
    throw Error("nearest points", "has coordinates that are not finite", "Remove those points.");
  }
  impl_ = std::make_unique<Impl>(points);
}

NearestPoints::~NearestPoints() = default;
NearestPoints::NearestPoints(NearestPoints&&) noexcept = default;
NearestPoints& NearestPoints::operator=(NearestPoints&&) noexcept = default;

Neighbor NearestPoints::Nearest(const Eigen::Vector3d& query) const {
  First result;
  if (query.allFinite()) impl_->index.findNeighbors(result, query.data(), flann::SearchParams());
  return result.best;
}

}  // namespace holdfast
