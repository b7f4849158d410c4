// SPDX-License-Identifier: MIT
#include "geometry/mesh/nearest.h"

#include <cmath>
#include <limits>
#include <random>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

using Neighbor = NearestPoints::Neighbor;

Neighbor BruteForce(const Eigen::Matrix3Xd& points, const Eigen::Vector3d& query) {
  Neighbor nearest{-1, std::numeric_limits<double>::infinity()};
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    // Summed in the order of the search, so that ties are ties in both.
    double squared = 0.0;
    for (int k = 0; k < 3; ++k) squared += (query[k] - points(k, i)) * (query[k] - points(k, i));
    const double distance = std::sqrt(squared);
    if (distance < nearest.distance) nearest = {static_cast<int>(i), distance};
  }
  return nearest;
}

struct Cloud {
  const char* name;
  Eigen::Matrix3Xd points;
};

/// Distributions that break trees: ties everywhere, all in one place, on a line, split far apart,
/// and over many magnitudes.
std::vector<Cloud> HostileClouds() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::uniform_int_distribution<int> lattice(-3, 3);
  const auto fill = [&](Eigen::Index n, auto&& coordinate) {
    Eigen::Matrix3Xd points(3, n);
    for (double& value : points.reshaped()) value = coordinate();
    return points;
  };
  std::vector<Cloud> clouds;
  clouds.push_back({"uniform", fill(500, [&] { return unit(random); })});
  clouds.push_back({"lattice with doubles", fill(700, [&] { return double(lattice(random)); })});
  clouds.push_back({"one place", Eigen::Matrix3Xd::Constant(3, 300, 0.25)});
  clouds.push_back({"a line", fill(400, [&] { return unit(random); })});
  clouds.back().points.bottomRows(2).setZero();
  clouds.push_back({"two clusters", fill(400, [&] { return 1e-6 * unit(random); })});
  clouds.back().points.leftCols(200).array() += 1e3;
  clouds.push_back({"many magnitudes", fill(500, [&] {
                      return std::copysign(std::pow(10.0, 8.0 * unit(random)), unit(random));
                    })});
  clouds.push_back({"one point", fill(1, [&] { return unit(random); })});
  return clouds;
}

TEST(NearestPoints, AgreesWithBruteForceOnHostileClouds) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1.5, 1.5);
  for (const Cloud& cloud : HostileClouds()) {
    SCOPED_TRACE(cloud.name);
    const NearestPoints search(cloud.points);
    const int n = static_cast<int>(cloud.points.cols());
    for (int i = 0; i < 200; ++i) {
      Eigen::Vector3d query(unit(random), unit(random), unit(random));
      if (i % 3 == 0) query = cloud.points.col(i % n);
      if (i % 3 == 1) query = (2.0 * query).array().round() / 2.0;  // between lattice points
      EXPECT_EQ(search.Nearest(query), BruteForce(cloud.points, query));
    }
  }
}

TEST(NearestPoints, ServesSeveralThreads) {
  const Eigen::Matrix3Xd points = HostileClouds()[0].points;
  const NearestPoints search(points);
  const auto nearest_of_each = [&] {
    std::vector<Neighbor> nearest;
    for (const auto& point : points.colwise()) nearest.push_back(search.Nearest(point));
    return nearest;
  };
  const std::vector<Neighbor> expected = nearest_of_each();
  std::vector<std::vector<Neighbor>> found(4);
  {
    std::vector<std::jthread> threads;
    for (auto& mine : found) threads.emplace_back([&] { mine = nearest_of_each(); });
  }
  EXPECT_THAT(found, ::testing::Each(expected));
}

TEST(NearestPoints, IsEmptyForAbsurdQueries) {
  const NearestPoints search(HostileClouds()[0].points);
  EXPECT_EQ(search.Nearest(Eigen::Vector3d::Constant(std::nan(""))).id, -1);
}

TEST(NearestPoints, RefusesNoPointsAndNoNumbers) {
  EXPECT_THROW(NearestPoints(Eigen::Matrix3Xd(3, 0)), Error);
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 4);
  points(2, 1) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(NearestPoints{points}, Error);
}

}  // namespace
}  // namespace holdfast
