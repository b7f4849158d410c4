// SPDX-License-Identifier: MIT
#include "solver/transfer/surface_map.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/object/load_object.h"
#include "geometry/rotation.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TriangleMesh Object(const char* name) { return LoadObject(name).mesh; }

// Largest distance of a vertex's image from where it belongs.
double WorstImage(const SurfaceMap& map, const TriangleMesh& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Matrix3Xd normals = VertexNormals(from);
  double worst = 0.0;
  for (Eigen::Index i = 0; i < from.NumVertices(); i += 7) {
    const SurfaceMap::Image image = map.At(from.vertices.col(i), normals.col(i));
    worst = std::max(worst, (image.point - to.col(i)).norm());
  }
  return worst;
}

TEST(SurfaceMap, OfAScaledObjectIsItsScale) {
  const TriangleMesh mug = Object("mug");
  const Vector3d factors(1.1, 0.9, 1.3);
  const SurfaceMap map = SurfaceMap::Scaled(mug, factors);
  EXPECT_LT(WorstImage(map, mug, factors.asDiagonal() * mug.vertices), 1e-9);
  EXPECT_NEAR(map.Report().stretch_most, 1.3, 1e-9);
  EXPECT_TRUE(map.Report().alike);
}

TEST(SurfaceMap, OntoItselfStaysInPlace) {
  for (const char* name : {"mug", "bottle", "cube", "hammer"}) {
    const TriangleMesh mesh = Object(name);
    const SurfaceMap map = SurfaceMap::Registered(mesh, mesh);
    EXPECT_LT(map.Report().turned_deg, 0.01) << name;
    EXPECT_LT(map.Report().residual_mm, 0.5) << name;
    EXPECT_LT(map.InPlace().translation().norm(), 1e-6) << name;
    EXPECT_TRUE(map.Report().alike) << name;
  }
}

TEST(SurfaceMap, FindsAMugThatWasTurnedAndScaled) {
  const TriangleMesh mug = Object("mug");
  TriangleMesh other = mug;
  const Eigen::Matrix3d turn = ExpSO3(Vector3d(0.0, 0.0, 1.2));
  other.vertices = turn * Vector3d(0.9, 1.1, 1.2).asDiagonal() * mug.vertices;
  const SurfaceMap map = SurfaceMap::Registered(mug, other);
  EXPECT_NEAR(map.Report().turned_deg, 1.2 / kDegree, 8.0);
  EXPECT_LT(WorstImage(map, mug, other.vertices), 0.010);
  EXPECT_TRUE(map.Report().alike);
}

TEST(SurfaceMap, SaysThatAMugIsNoHammer) {
  EXPECT_FALSE(SurfaceMap::Registered(Object("mug"), Object("hammer")).Report().alike);
}

TEST(SurfaceMap, FollowsTheVerticesOfAFile) {
  const testing::TemporaryFolder folder;
  const TriangleMesh bottle = Object("bottle");
  TriangleMesh other = bottle;
  other.vertices = Vector3d(1.2, 1.2, 0.9).asDiagonal() * bottle.vertices;
  std::ofstream rows(folder / "map.txt");
  rows << "# a vertex each\n";
  for (Eigen::Index i = 0; i < bottle.NumVertices(); ++i) rows << i << '\n';
  rows.close();
  const SurfaceMap map = SurfaceMap::FromFile(bottle, other, folder / "map.txt");
  EXPECT_EQ(map.Report().method, "given");
  EXPECT_LT(WorstImage(map, bottle, other.vertices), 0.005);
}

TEST(SurfaceMap, RefusesFilesThatFitNoObject) {
  const testing::TemporaryFolder folder;
  const TriangleMesh cube = Object("cube");
  const auto with = [&](const char* text) {
    std::ofstream(folder / "map.txt") << text;
    return [&] { SurfaceMap::FromFile(cube, cube, folder / "map.txt"); };
  };
  EXPECT_THAT(with("0\n1\n"), ThrowsMessage<Error>(HasSubstr("has 2 rows")));
  EXPECT_THAT(with("0 0 x\n"), ThrowsMessage<Error>(HasSubstr("'x' is not a number")));
  EXPECT_THAT(with("0 0 nan 0 0 0\n"), ThrowsMessage<Error>(HasSubstr("is not a number")));
  EXPECT_THAT(with("0 0 0\n"), ThrowsMessage<Error>(HasSubstr("line 1 has 3 numbers")));
  EXPECT_THAT(with(""), ThrowsMessage<Error>(HasSubstr("at least four pairs")));
  EXPECT_THAT(with("25 0 0 25 0 0\n0 25 0 0 25 0\n0 0 25 0 0 25\n9 9 9 9 9 9\n"),
              ThrowsMessage<Error>(HasSubstr("off the surface")));
  EXPECT_THAT([&] { SurfaceMap::FromFile(cube, cube, folder / "none.txt"); },
              ThrowsMessage<Error>(HasSubstr("cannot be read")));
}

TEST(SurfaceMap, RefusesScalesThatAreNone) {
  const TriangleMesh cube = Object("cube");
  for (const double factor : {0.0, -1.0, 1e6, std::nan("")}) {
    EXPECT_THROW(SurfaceMap::Scaled(cube, Vector3d(1.0, factor, 1.0)), Error) << factor;
  }
}

}  // namespace
}  // namespace holdfast
