// SPDX-License-Identifier: MIT
#include "geometry/mesh/convex_hull.h"

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
