// SPDX-License-Identifier: MIT
#include "geometry/mesh/half_edges.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/rotation.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using testing::Box;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;
using testing::Sheet;
using ::testing::SizeIs;
using testing::Sphere;

TEST(HalfEdges, LoopsGoAroundHolesAsTheFacesBesideThemDo) {
  TriangleMesh box = Box({0, 0, 0}, {1, 1, 1});
  EXPECT_THAT(HalfEdges(box).BoundaryLoops(), IsEmpty());
  const Eigen::Vector3i lid = box.faces.col(11);
  box.faces.conservativeResize(Eigen::NoChange, 11);
  const HalfEdges open(box);
  EXPECT_EQ(open.NumApart(), 0);
  const std::vector<std::vector<int>> loops = open.BoundaryLoops();
  ASSERT_THAT(loops, SizeIs(1));
  // The face that closes the hole runs against the faces beside it.
  std::vector<int> loop = loops[0];
  ASSERT_THAT(loop, SizeIs(3));
  std::rotate(loop.begin(), std::ranges::find(loop, lid[0]), loop.end());
  EXPECT_THAT(loop, ElementsAre(lid[0], lid[2], lid[1]));
}

TEST(HalfEdges, EveryVertexOfASheetsEdgeIsInItsLoopOnce) {
  std::vector<std::vector<int>> loops = HalfEdges(Sheet(4, 0.01)).BoundaryLoops();
  ASSERT_THAT(loops, SizeIs(1));
  EXPECT_THAT(loops[0], SizeIs(16));
  std::ranges::sort(loops[0]);
  EXPECT_EQ(std::ranges::adjacent_find(loops[0]), loops[0].end());
}

TEST(HalfEdges, EdgesOfABoxAreSharpAndItsDiagonalsAreNot) {
  EXPECT_THAT(HalfEdges(Box({0, 0, 0}, {1, 2, 3})).SharpEdges(20.0 * kDegree), SizeIs(12));
  EXPECT_THAT(HalfEdges(Sphere(0.05, 4)).SharpEdges(20.0 * kDegree), IsEmpty());
}

TEST(HalfEdges, AFaceThatIsNotManifoldStandsApart) {
  TriangleMesh fin = testing::WithVertex(Box({0, 0, 0}, {1, 1, 1}), {2, 2, 2});
  fin = testing::WithFace(testing::WithFace(fin, 0, 1, 8), 2, 2, 3);  // the last is no face
  const HalfEdges edges(fin);
  EXPECT_EQ(edges.NumApart(), 1);
  EXPECT_THAT(edges.BoundaryLoops(), ElementsAre(SizeIs(3)));
  EXPECT_THAT(edges.SharpEdges(20.0 * kDegree),
              ::testing::AllOf(SizeIs(14), ::testing::Contains(Pair(0, 8)),
                               ::testing::Contains(Pair(1, 8))));
  TriangleMesh turned = Sheet(2, 0.1);
  std::swap(turned.faces(1, 0), turned.faces(2, 0));
  EXPECT_GT(HalfEdges(turned).NumApart(), 0);
}

}  // namespace
}  // namespace holdfast
