// SPDX-License-Identifier: MIT
#include "geometry/mesh/triangle_tree.h"

#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

struct Random {
  explicit Random(unsigned seed) : engine(seed) {}
  Eigen::Vector3d Point(double size) {
    std::uniform_real_distribution<double> side(-size, size);
    const double x = side(engine), y = side(engine), z = side(engine);
    return {x, y, z};
  }
  std::mt19937 engine;
};

// Triangles anywhere, of all sizes, some of them needles, some without area.
TriangleMesh Soup(Random& random, int count, const Eigen::Vector3d& middle) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 3 * count);
  mesh.faces.resize(3, count);
  for (int f = 0; f < count; ++f) {
    const Eigen::Vector3d at = middle + random.Point(0.1);
    const double size = f % 3 == 0 ? 0.05 : 0.003;
    for (int k = 0; k < 3; ++k) mesh.vertices.col(3 * f + k) = at + random.Point(size);
    if (f % 5 == 0) {  // nearly a line
      mesh.vertices.col(3 * f + 2) = mesh.vertices.col(3 * f) + random.Point(1e-9);
    }
    if (f % 17 == 0) mesh.vertices.col(3 * f + 1) = mesh.vertices.col(3 * f);
    mesh.faces.col(f) << 3 * f, 3 * f + 1, 3 * f + 2;
  }
  return mesh;
}

TriangleTree::Hit BruteForce(const TriangleMesh& mesh, const Eigen::Vector3d& p) {
  TriangleTree::Hit best;
  best.squared_distance = std::numeric_limits<double>::infinity();
  for (int f = 0; f < mesh.NumFaces(); ++f) {
    if (!(FaceCross(mesh, f).squaredNorm() > 0.0)) continue;
    const TrianglePoint on =
        ClosestOnTriangle(p, mesh.vertices.col(mesh.faces(0, f)),
                          mesh.vertices.col(mesh.faces(1, f)), mesh.vertices.col(mesh.faces(2, f)));
    const double squared = (p - on.point).squaredNorm();
    if (squared < best.squared_distance) best = {on.point, on.feature, f, squared};
  }
  return best;
}

void ExpectSame(const TriangleTree::Hit& hit, const TriangleTree::Hit& expected) {
  EXPECT_EQ(hit.face, expected.face);
  EXPECT_EQ(hit.squared_distance, expected.squared_distance);
  EXPECT_EQ(hit.point, expected.point);
  EXPECT_EQ(hit.feature, expected.feature);
}

TEST(TriangleTree, IsThatOfBruteForceWhateverTheHint) {
  Random random(1);
  for (const int count : {1, 7, 8, 9, 65, 700}) {
    const Eigen::Vector3d middle =
        count == 65 ? Eigen::Vector3d(90.0, -40.0, 7.0) : random.Point(1.0);
    TriangleMesh mesh = Soup(random, count + 1, middle);
    const TriangleTree tree(mesh);
    for (int i = 0; i < 200; ++i) {
      const double far = i % 10 == 0 ? 1e4 : i % 3 == 0 ? 1.0 : 0.12;
      const Eigen::Vector3d p = middle + random.Point(far);
      const TriangleTree::Hit expected = BruteForce(mesh, p);
      ExpectSame(tree.Closest(p), expected);
      ExpectSame(tree.Closest(p, expected.face), expected);
      ExpectSame(tree.Closest(p, i % (count + 1)), expected);  // some have no area
    }
  }
}

TEST(TriangleTree, OfEquallyNearFacesTheFirstIsGiven) {
  const TriangleMesh mesh = testing::Sphere(0.05, 3);
  const TriangleTree tree(mesh);
  for (int v = 0; v < mesh.NumVertices(); v += 5) {
    const Eigen::Vector3d p = 1.3 * mesh.vertices.col(v);
    for (const int hint : {-1, 0, 100, 511}) ExpectSame(tree.Closest(p, hint), BruteForce(mesh, p));
  }
}

TEST(TriangleTree, MovesWithItsVertices) {
  Random random(2);
  TriangleMesh mesh = testing::Torus(0.05, 0.02, 40, 24);
  TriangleTree tree(mesh);
  mesh.vertices =
      (Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix() *
       mesh.vertices)
          .colwise() +
      Eigen::Vector3d(0.3, 0.0, -2.0);
  mesh.vertices.row(1) *= 1.7;
  tree.Move(mesh);
  EXPECT_EQ(tree.Min(), Eigen::Vector3d(mesh.vertices.rowwise().minCoeff()));
  EXPECT_EQ(tree.Max(), Eigen::Vector3d(mesh.vertices.rowwise().maxCoeff()));
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p = Eigen::Vector3d(0.3, 0.0, -2.0) + random.Point(0.2);
    ExpectSame(tree.Closest(p, i), BruteForce(mesh, p));
  }
}

TEST(TriangleTree, FindsTheFacesInABox) {
  Random random(3);
  const TriangleMesh mesh = testing::Sphere(0.05, 4);
  const TriangleTree tree(mesh);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d low = random.Point(0.06);
    const Eigen::Vector3d high = low + 0.02 * Eigen::Vector3d::Ones();
    std::vector<int> expected;
    for (int f = 0; f < mesh.NumFaces(); ++f) {
      const Eigen::Matrix3d c = mesh.vertices(Eigen::all, mesh.faces.col(f));
      const bool apart = (c.rowwise().minCoeff().array() > high.array()).any() ||
                         (c.rowwise().maxCoeff().array() < low.array()).any();
      if (!apart) expected.push_back(f);
    }
    EXPECT_EQ(tree.FacesInBox(low, high), expected);
  }
}

TEST(TriangleTree, AQueryThatIsNoNumberHasAFace) {
  const TriangleTree tree(testing::Sphere(0.05, 2));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const TriangleTree::Hit hit = tree.Closest({nan, 0.0, 0.0});
  EXPECT_GE(hit.face, 0);
  EXPECT_TRUE(std::isnan(hit.squared_distance));
}

}  // namespace
}  // namespace holdfast
