// SPDX-License-Identifier: MIT
#include "geometry/mesh/convex_pieces.h"

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/object/load_object.h"

namespace holdfast {
namespace {

TEST(ConvexPieces, AConvexSolidIsOnePiece) {
  const TriangleMesh cube = LoadObject("cube").mesh;
  const ConvexPieces split = SplitIntoConvexPieces(cube);
  ASSERT_EQ(split.pieces.size(), 1u);
  EXPECT_LT(split.excess_m, 0.002);
  EXPECT_NEAR(SignedVolume(split.pieces[0]), SignedVolume(cube), 0.02 * SignedVolume(cube));
}

TEST(ConvexPieces, OfAHammerReachOutNoFartherThanAsked) {
  const TriangleMesh hammer = LoadObject("hammer").mesh;
  ConvexPieceOptions options;
  const ConvexPieces split = SplitIntoConvexPieces(hammer, options);
  EXPECT_GT(split.pieces.size(), 1u);
  EXPECT_LE(split.excess_m, options.tolerance_m);
  options.threads = 3;
  const ConvexPieces again = SplitIntoConvexPieces(hammer, options);
  ASSERT_EQ(again.pieces.size(), split.pieces.size());
  for (std::size_t k = 0; k < split.pieces.size(); ++k) {
    EXPECT_TRUE(again.pieces[k].vertices == split.pieces[k].vertices);
  }
}

TEST(ConvexPieces, RefusesWhatSpansNoVolume) {
  TriangleMesh flat;
  flat.vertices = Eigen::Matrix3Xd{{0.0, 0.1, 0.0}, {0.0, 0.0, 0.1}, {0.0, 0.0, 0.0}};
  flat.faces = Eigen::Matrix3Xi{{0}, {1}, {2}};
  EXPECT_THROW(SplitIntoConvexPieces(flat), Error);
}

}  // namespace
}  // namespace holdfast
