// SPDX-License-Identifier: MIT
#include "geometry/mesh/nearest.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <flann/flann.hpp>

#include "geometry/error.h"

namespace holdfast {
namespace {

using Neighbour = NearestPoints::Neighbour;
using Index = flann::KDTreeSingleIndex<flann::L2_3D<double>>;

constexpr int kLeafSize = 10;

/// How far FLANN has to look, squared, to find all at `distance`. It prunes on sums that may be off
/// by a few ulps: looking that much further makes sure that no tie is missed.
double SearchLimit(double distance) {
  constexpr double kSlack = 1.0 + 1e-12;
  return std::max(distance * distance * kSlack, std::numeric_limits<double>::min());
}

bool Before(const Neighbour& a, const Neighbour& b) {
  return a.distance < b.distance || (a.distance == b.distance && a.id < b.id);
}

/// The `capacity` first by (distance, id), kept as a heap with the last on top.
class FirstByDistanceAndId final : public flann::ResultSet<double> {
 public:
  explicit FirstByDistanceAndId(std::size_t capacity) : capacity_(capacity) {
    found_.reserve(capacity);
  }

  bool full() const override { return found_.size() == capacity_; }

  void addPoint(double squared_distance, std::size_t index) override {
    const Neighbour candidate{static_cast<int>(index), std::sqrt(squared_distance)};
    if (full()) {
      if (!Before(candidate, found_.front())) return;
      std::pop_heap(found_.begin(), found_.end(), Before);
      found_.back() = candidate;
    } else {
      found_.push_back(candidate);
    }
    std::push_heap(found_.begin(), found_.end(), Before);
  }

  double worstDist() const override {
    if (!full()) return std::numeric_limits<double>::infinity();
    return SearchLimit(found_.front().distance);
  }

  std::vector<Neighbour> Take() {
    std::sort_heap(found_.begin(), found_.end(), Before);
    return std::move(found_);
  }

 private:
  std::size_t capacity_;
  std::vector<Neighbour> found_;
};

/// The first by (distance, id), without allocation.
class First final : public flann::ResultSet<double> {
 public:
  bool full() const override { return best.id >= 0; }

  void addPoint(double squared_distance, std::size_t index) override {
    const Neighbour candidate{static_cast<int>(index), std::sqrt(squared_distance)};
    if (best.id < 0 || Before(candidate, best)) best = candidate;
  }

  double worstDist() const override { return SearchLimit(best.distance); }

  Neighbour best{-1, std::numeric_limits<double>::infinity()};
};

/// Everything within a radius, the radius included.
class Within final : public flann::ResultSet<double> {
 public:
  explicit Within(double radius) : radius_(radius) {}

  bool full() const override { return true; }

  void addPoint(double squared_distance, std::size_t index) override {
    const double distance = std::sqrt(squared_distance);
    if (distance <= radius_) found.push_back({static_cast<int>(index), distance});
  }

  double worstDist() const override { return SearchLimit(radius_); }

  std::vector<Neighbour> found;

 private:
  double radius_;
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

  void Search(const Eigen::Vector3d& query, flann::ResultSet<double>& result) const {
    if (query.allFinite()) index.findNeighbors(result, query.data(), flann::SearchParams());
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

Eigen::Index NearestPoints::NumPoints() const { return impl_->points.cols(); }

Neighbour NearestPoints::Nearest(const Eigen::Vector3d& query) const {
  First result;
  impl_->Search(query, result);
  return result.best;
}

std::vector<Neighbour> NearestPoints::NearestOfEach(const Eigen::Matrix3Xd& queries) const {
  std::vector<Neighbour> nearest(queries.cols());
  for (Eigen::Index i = 0; i < queries.cols(); ++i) {
    nearest[i] = Nearest(queries.col(i));
  }
  return nearest;
}

std::vector<Neighbour> NearestPoints::KNearest(const Eigen::Vector3d& query, int k) const {
  if (k <= 0) return {};
  FirstByDistanceAndId result(std::min<std::size_t>(k, NumPoints()));
  impl_->Search(query, result);
  return result.Take();
}

std::vector<Neighbour> NearestPoints::WithinRadius(const Eigen::Vector3d& query,
                                                   double radius) const {
  if (!(radius >= 0.0)) return {};
  Within result(radius);
  impl_->Search(query, result);
  std::sort(result.found.begin(), result.found.end(), Before);
  return std::move(result.found);
}

}  // namespace holdfast
