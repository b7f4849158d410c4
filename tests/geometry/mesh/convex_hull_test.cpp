// SPDX-License-Identifier: MIT
#include "geometry/mesh/convex_hull.h"

#include <memory>
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
  Eigen::Matrix3Xd points(3, 300);  // a ball's, and those of a block's faces, many in one plane
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-0.6, 0.6);
  for (int k = 0; k < points.cols(); ++k) {
    points.col(k) << unit(random), unit(random), unit(random);
    if (k % 2 == 0) points.col(k) = points.col(k).normalized().eval();
    if (k % 2 == 1) points(k % 3, k) = k % 4 == 1 ? 0.9 : -0.9;
  }
  const TriangleMesh hull = ConvexHull(points);
  std::vector<std::unique_ptr<char[]>> held;
  for (int trial = 0; trial < 20; ++trial) {
    for (int k = 0; k < 200; ++k) {
      held.push_back(std::make_unique<char[]>(static_cast<std::size_t>(random() % 4000)));
      if (k % 3 == 0) held[random() % held.size()].reset();
    }
    const TriangleMesh again = ConvexHull(points);
    ASSERT_EQ(again.vertices, hull.vertices);
    ASSERT_EQ(again.faces, hull.faces);
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

}  // namespace
}  // namespace holdfast
