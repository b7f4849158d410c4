// SPDX-License-Identifier: MIT
#include "geometry/score/clipped_volume.h"

#include <random>

#include <gtest/gtest.h>

#include "geometry/rotation.h"
#include "geometry/score/contact_metrics.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

TriangleMesh Turned(TriangleMesh mesh, const Eigen::Vector3d& by, const Eigen::Vector3d& turn) {
  mesh.vertices = (ExpSO3(turn) * mesh.vertices).colwise() + by;
  return mesh;
}

SolidOverlap OverlapOf(const Solid& a, const Solid& b) {
  std::vector<int> inside;
  for (int v = 0; v < a.mesh.NumVertices(); ++v) {
    if (b.distance.Inside(a.mesh.vertices.col(v))) inside.push_back(v);
  }
  return FindOverlap(a, b, a.distance.Distances(b.mesh.vertices), inside);
}

std::optional<double> Clipped(const Solid& a, const Solid& b) {
  return ClippedVolume(a, b, OverlapOf(a, b));
}

TEST(ClippedVolume, BothSidesOfAPlaneAddUp) {
  const Solid torus(testing::Torus(0.04, 0.015, 24, 12));
  const Solid around(testing::Box({-0.2, -0.2, -0.2}, {0.2, 0.2, 0.2}));
  const double whole = Clipped(torus, around).value();
  EXPECT_NEAR(whole, 2.0 * 9.8696 * 0.04 * 0.015 * 0.015, 0.1 * whole);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int round = 0; round < 10; ++round) {
    const Eigen::Vector3d turn(3 * unit(random), 3 * unit(random), 3 * unit(random));
    const Eigen::Vector3d by(0.02 * unit(random), 0.02 * unit(random), 0.02 * unit(random));
    const Solid above(Turned(testing::Box({-1, -1, 0}, {1, 1, 1}), by, turn));
    const Solid below(Turned(testing::Box({-1, -1, -1}, {1, 1, 0}), by, turn));
    const std::optional<double> up = Clipped(torus, above), down = Clipped(below, torus);
    ASSERT_TRUE(up && down) << round;
    EXPECT_NEAR(*up + *down, whole, 1e-12 * whole) << round;
    EXPECT_GT(*up, 0.0);
  }
}

TEST(ClippedVolume, NothingWhereSurfacesLieOnEachOther) {
  const Solid box(testing::Box({0, 0, 0}, {2, 2, 2}));
  EXPECT_FALSE(Clipped(box, box));
  EXPECT_FALSE(Clipped(box, Solid(testing::Box({0.5, 0.5, 1}, {1, 1, 2}))));
  EXPECT_NEAR(Clipped(box, Solid(testing::Box({0.5, 0.5, 0.5}, {1, 1, 1}))).value(), 0.125, 1e-15);
}

TEST(ClippedVolume, NothingWhereOutlinesDoNotClose) {
  const Solid torus(testing::Torus(0.04, 0.015, 24, 12));
  const Solid above(Turned(testing::Box({-1, -1, 0}, {1, 1, 1}), {0.01, 0, 0}, {0.5, 0.3, 0.1}));
  SolidOverlap overlap = OverlapOf(torus, above);
  overlap.faces_a.pop_back();
  EXPECT_FALSE(ClippedVolume(torus, above, overlap));
}

TEST(IntersectionVolume, IsTheSameByTheOverlap) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const Solid torus(testing::Torus(0.04, 0.015, 24, 12));
  int shared = 0;
  for (int round = 0; round < 10; ++round) {
    const Eigen::Vector3d turn(3 * unit(random), 3 * unit(random), 3 * unit(random));
    const Eigen::Vector3d by(0.05 * unit(random), 0.05 * unit(random), 0.05 * unit(random));
    const Solid box(Turned(testing::Box({-0.03, -0.02, -0.04}, {0.03, 0.02, 0.04}), by, turn));
    const double volume = IntersectionVolume(torus, box, OverlapOf(torus, box), 0.002);
    EXPECT_EQ(volume, IntersectionVolume(torus.distance, box.distance, 0.002)) << round;
    shared += volume > 0.0;
  }
  EXPECT_GT(shared, 5);
}

}  // namespace
}  // namespace holdfast
