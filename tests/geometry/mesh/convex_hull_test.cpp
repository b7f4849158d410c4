// SPDX-License-Identifier: MIT
#include "geometry/mesh/convex_hull.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace holdfast {
namespace {

TEST(ConvexHullOfPoints, OfACubeWithPointsInsideIsTheCube) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 108) * 0.5;
  for (int k = 0; k < 8; ++k)
    points.col(100 + k) << (k & 1) - 0.5, (k >> 1 & 1) - 0.5, (k >> 2) - 0.5;
  const TriangleMesh hull = ConvexHull(points);
  EXPECT_EQ(hull.NumVertices(), 8);
  EXPECT_EQ(hull.NumFaces(), 12);
  EXPECT_NEAR(SignedVolume(hull), 1.0, 1e-12);
}

// Wherever its parts lie in memory.
TEST(ConvexHullOfPoints, IsTheSameEveryTime) {
  Eigen::Matrix3Xd mixed(3, 300);  // a ball's, and those of a block's faces, many in one plane
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-0.6, 0.6);
  for (int k = 0; k < mixed.cols(); ++k) {
    mixed.col(k) << unit(random), unit(random), unit(random);
    if (k % 2 == 0) mixed.col(k) = mixed.col(k).normalized().eval();
    if (k % 2 == 1) mixed(k % 3, k) = k % 4 == 1 ? 0.9 : -0.9;
  }
  // A rounded bar: rectangles side by side, flat to the last bit.
  constexpr int kSides = 40;
  Eigen::Matrix3Xd prism(3, 2 * kSides);
  for (int k = 0; k < kSides; ++k) {
    const double turn = 2.0 * std::numbers::pi * k / kSides;
    const auto x = static_cast<double>(static_cast<float>(0.01 * std::cos(turn)));
    const auto z = static_cast<double>(static_cast<float>(0.01 * std::sin(turn)));
    prism.col(2 * k) << x, -0.0134500004351, z;
    prism.col(2 * k + 1) << x, 0.0134500004351, z;
  }
  EXPECT_EQ(ConvexHull(prism).NumVertices(), 2 * kSides);
  for (const Eigen::Matrix3Xd& points : {mixed, prism}) {
    const TriangleMesh hull = ConvexHull(points);
    std::vector<std::unique_ptr<char[]>> held;
    for (int trial = 0; trial < 50; ++trial) {
      for (int k = 0; k < 200; ++k) {
        held.push_back(std::make_unique<char[]>(static_cast<std::size_t>(random() % 4000)));
        if (k % 3 == 0) held[random() % held.size()].reset();
      }
      const TriangleMesh again = ConvexHull(points);
      ASSERT_EQ(again.vertices, hull.vertices);
      ASSERT_EQ(again.faces, hull.faces);
    }
  }
}

// Points exactly on edges and in flat faces are no corners, in whatever order they come.
TEST(ConvexHullOfPoints, OfACubesGridIsTheCube) {
  constexpr int kSide = 6;
  std::vector<Eigen::Vector3d> grid;
  for (int k = 0; k < kSide * kSide * kSide; ++k) {
    grid.emplace_back(k % kSide, k / kSide % kSide, k / (kSide * kSide));
  }
  std::mt19937 random(5);
  TriangleMesh first;
  for (int trial = 0; trial < 20; ++trial) {
    std::ranges::shuffle(grid, random);
    Eigen::Matrix3Xd points(3, grid.size());
    for (std::size_t k = 0; k < grid.size(); ++k) {
      points.col(static_cast<Eigen::Index>(k)) = 0.013 * grid[k];
    }
    const TriangleMesh hull = ConvexHull(points);
    ASSERT_EQ(hull.NumVertices(), 8);
    ASSERT_EQ(hull.NumFaces(), 12);
    if (trial == 0) first = hull;
    ASSERT_EQ(hull.vertices, first.vertices);
    ASSERT_EQ(hull.faces, first.faces);
  }
}

TEST(ConvexHullOfPoints, OfWhatIsFlatHasNoFaces) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 20);
  EXPECT_EQ(ConvexHull(points.leftCols(3)).NumFaces(), 0);
  EXPECT_EQ(ConvexHull(points.leftCols(1)).NumFaces(), 0);
  EXPECT_EQ(ConvexHull(Eigen::Matrix3Xd(3, 0)).NumFaces(), 0);
  points.row(2).setZero();
  EXPECT_EQ(ConvexHull(points).NumFaces(), 0);
  points.row(1).setZero();
  EXPECT_EQ(ConvexHull(points).NumFaces(), 0);
  points.setZero();
  EXPECT_EQ(ConvexHull(points).NumFaces(), 0);
}

// No four in a plane: one hull is enough, and it is the same to the last bit.
TEST(ConvexHullOfPoints, OfJitteredPointsAreTheSameInOnePass) {
  for (const int side : {3, 6}) {
    Eigen::Matrix3Xd lattice(3, side * side * side);
    for (int k = 0; k < lattice.cols(); ++k) {
      lattice.col(k) << k % side, k / side % side, k / (side * side);
    }
    const Eigen::Matrix3Xd points = Jittered(DistinctPoints(0.01 * lattice), 4e-6);
    const TriangleMesh whole = ConvexHull(points), once = ConvexHullOfJittered(points);
    ASSERT_GT(whole.NumFaces(), 20);
    EXPECT_EQ(whole.vertices, once.vertices);
    EXPECT_EQ(whole.faces, once.faces);
  }
  EXPECT_EQ(ConvexHullOfJittered(Eigen::Matrix3Xd::Identity(3, 3)).NumFaces(), 0);
}

}  // namespace
}  // namespace holdfast
