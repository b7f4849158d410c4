// SPDX-License-Identifier: MIT
#include "geometry/mesh/mesh_check.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

TEST(RepairMesh, RefusesAFanThatNobodyCouldWaitFor) {
  for (const int faces : {20'000, 20'001}) {
    TriangleMesh mesh;
    mesh.vertices.resize(3, faces + 1);
    mesh.vertices.col(0).setZero();
    mesh.faces.resize(3, faces);
    for (int i = 0; i < faces; ++i) {
      mesh.vertices.col(1 + i) << std::cos(6.283185307 * i / faces),
          std::sin(6.283185307 * i / faces), 0;
      mesh.faces.col(i) << 0, 1 + i, 1 + (i + 1) % faces;
    }
    if (faces == 20'000) {
      EXPECT_NO_THROW(RepairMesh(mesh));
    } else {
      EXPECT_THROW(RepairMesh(mesh), Error);
    }
  }
}

using ::testing::AllOf;
using testing::Box;
using ::testing::Contains;
using ::testing::ElementsAre;
using testing::Exploded;
using ::testing::HasSubstr;
using testing::InsideOut;
using ::testing::IsEmpty;
using testing::Sheet;
using testing::Sphere;
using testing::Together;
using testing::Torus;
using testing::WithFace;
using testing::WithVertex;

const TriangleMesh kBox = Box({0, 0, 0}, {0.1, 0.2, 0.3});

TEST(CheckMesh, ACleanMeshIsWatertight) {
  const MeshReport report = CheckMesh(kBox);
  EXPECT_EQ(report.num_vertices, 8);
  EXPECT_EQ(report.num_faces, 12);
  EXPECT_EQ(report.num_edges, 18);
  EXPECT_EQ(report.num_components, 1);
  EXPECT_TRUE(report.watertight);
  EXPECT_FALSE(report.implausible_size);
  EXPECT_NEAR(report.volume_m3, 0.006, 1e-15);
  EXPECT_NEAR(report.area_m2, 0.22, 1e-15);
  EXPECT_LT((report.extent_m - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-15);
  EXPECT_THAT(Describe(report), Contains(HasSubstr("Watertight")));
  EXPECT_TRUE(CheckMesh(Sphere(0.05, 4)).watertight);
  EXPECT_TRUE(CheckMesh(Torus(0.05, 0.02, 12, 9)).watertight);
}

TEST(CheckMesh, CountsEachFault) {
  MeshReport report = CheckMesh(Sheet(3, 0.1));
  EXPECT_EQ(report.num_boundary_edges, 12);
  EXPECT_FALSE(report.watertight);

  report = CheckMesh(WithFace(WithVertex(kBox, {1, 1, 1}), 0, 1, 8));  // a fin
  EXPECT_EQ(report.num_non_manifold_edges, 1);
  EXPECT_EQ(report.num_boundary_edges, 2);

  report = CheckMesh(WithVertex(kBox, {1, 1, 1}));
  EXPECT_EQ(report.num_unreferenced_vertices, 1);
  EXPECT_TRUE(report.watertight);
  EXPECT_NEAR(report.extent_m.z(), 0.3, 1e-15);  // of the surface alone

  report = CheckMesh(WithFace(kBox, 3, 5, 5));
  EXPECT_EQ(report.num_degenerate_faces, 1);
  EXPECT_FALSE(report.watertight);

  report = CheckMesh(WithFace(kBox, kBox.faces(1, 4), kBox.faces(2, 4), kBox.faces(0, 4)));
  EXPECT_EQ(report.num_duplicate_faces, 1);
  EXPECT_EQ(report.num_non_manifold_edges, 3);

  TriangleMesh turned = kBox;
  std::swap(turned.faces(0, 7), turned.faces(1, 7));
  report = CheckMesh(turned);
  EXPECT_EQ(report.num_misoriented_edges, 3);
  EXPECT_FALSE(report.watertight);

  report = CheckMesh(InsideOut(kBox));
  EXPECT_EQ(report.num_inside_out_components, 1);
  EXPECT_LT(report.volume_m3, 0.0);
  EXPECT_FALSE(report.watertight);

  report = CheckMesh(Exploded(kBox));
  EXPECT_EQ(report.num_duplicate_vertices, 36 - 8);
  EXPECT_EQ(report.num_components, 12);
}

TEST(CheckMesh, FindsVerticesWhereSurfacesTouch) {
  TriangleMesh two = Together(kBox, kBox);
  two.vertices.rightCols<8>().colwise() += Eigen::Vector3d(0.1, 0.2, 0.3);
  for (int& v : two.faces.reshaped()) v = v == 8 ? 7 : v;  // both have the corner
  const MeshReport report = CheckMesh(two);
  EXPECT_EQ(report.num_non_manifold_vertices, 1);
  EXPECT_EQ(report.num_non_manifold_edges, 0);
  EXPECT_EQ(report.num_components, 2);
  EXPECT_FALSE(report.watertight);
}

TEST(CheckMesh, TellsCavitiesFromSolidsWithinSolids) {
  const TriangleMesh outer = Sphere(0.1, 3);
  const TriangleMesh inner = Sphere(0.05, 3);
  EXPECT_TRUE(CheckMesh(Together(outer, InsideOut(inner))).watertight);
  EXPECT_EQ(CheckMesh(Together(outer, inner)).num_nested_solids, 1);
  // A ball in the cavity, in either order.
  const TriangleMesh ball = Sphere(0.02, 3);
  EXPECT_TRUE(CheckMesh(Together(ball, Together(InsideOut(inner), outer))).watertight);
  EXPECT_EQ(CheckMesh(Together(InsideOut(outer), inner)).num_inside_out_components, 1);
}

TEST(CheckMesh, GuessesTheUnit) {
  TriangleMesh mesh = kBox;
  mesh.vertices *= 1000.0;
  MeshReport report = CheckMesh(mesh);
  EXPECT_TRUE(report.implausible_size);
  EXPECT_EQ(report.suggested_scale, 0.001);
  EXPECT_THAT(Describe(report), Contains(AllOf(HasSubstr("millimeters"), HasSubstr("0.001"))));
  mesh.vertices /= 1e6;
  EXPECT_EQ(CheckMesh(mesh).suggested_scale, 1000.0);
  mesh.vertices *= 1e14;
  report = CheckMesh(mesh);
  EXPECT_TRUE(report.implausible_size);
  EXPECT_EQ(report.suggested_scale, 1.0);
}

TEST(CheckMesh, SuggestsWhatMakesAnythingHandSized) {
  // In meters: a mug, a phone, a knife, a pan, a sword, a broom, a sheet of paper, a pen.
  const Eigen::Vector3d sizes[] = {{0.12, 0.09, 0.10},   {0.15, 0.07, 0.008}, {0.25, 0.03, 0.015},
                                   {0.42, 0.24, 0.06},   {0.95, 0.16, 0.03},  {1.5, 0.025, 0.025},
                                   {0.297, 0.21, 0.001}, {0.15, 0.01, 0.01}};
  for (const Eigen::Vector3d& size : sizes) {
    for (const double unit : {0.01, 0.001}) {
      const MeshReport report = CheckMesh(Box(Eigen::Vector3d::Zero(), size / unit));
      ASSERT_TRUE(report.implausible_size);
      EXPECT_EQ(report.suggested_scale, unit) << size.transpose() / unit;
    }
  }
  // Hand-sized in inches alone.
  EXPECT_EQ(CheckMesh(Box(Eigen::Vector3d::Zero(), {2.5, 1.5, 1.0})).suggested_scale, 0.0254);
}

TEST(CheckMesh, NamesAllUnitsThatExplainASize) {
  const auto scales = [](double size, const char* path) {
    return PossibleScales(Eigen::Vector3d::Constant(size), path);
  };
  EXPECT_THAT(scales(20.0, "a.obj"), ElementsAre(0.01, 0.001));
  EXPECT_THAT(scales(20.0, "a.stl"), ElementsAre(0.001, 0.01));
  EXPECT_THAT(scales(100.0, "a.obj"), ElementsAre(0.001));
  EXPECT_THAT(scales(4.0, "a.stl"), ElementsAre(0.01, 0.0254));  // 4 mm is no size to hold
  EXPECT_THAT(scales(0.1, "a.stl"), IsEmpty());                  // meters
  EXPECT_THAT(UnitRemedy(Eigen::Vector3d::Constant(1e9), "a.obj"),
              HasSubstr("give its unit with --object-scale"));
}

TEST(CheckMesh, IsIndependentOfUnitAndPlace) {
  for (const double scale : {1e-6, 1e6}) {
    TriangleMesh mesh = Sphere(0.05, 3);
    mesh.vertices *= scale;
    mesh.vertices.colwise() += scale * Eigen::Vector3d(30, -20, 10);
    EXPECT_TRUE(CheckMesh(mesh).watertight);
  }
}

TEST(CheckMesh, RefusesWhatIsNoMesh) {
  TriangleMesh mesh = kBox;
  mesh.faces(1, 3) = 8;
  EXPECT_THROW(CheckMesh(mesh), Error);
  mesh.faces(1, 3) = -1;
  EXPECT_THROW(CheckMesh(mesh), Error);
  mesh = kBox;
  mesh.vertices(0, 0) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(RepairMesh(mesh), Error);
  EXPECT_FALSE(CheckMesh(TriangleMesh{}).watertight);
  EXPECT_THROW(RepairMesh(TriangleMesh{}), Error);
}

TEST(RepairMesh, LeavesACleanMeshAlone) {
  const TriangleMesh torus = Torus(0.05, 0.02, 12, 9);
  const RepairedMesh repaired = RepairMesh(torus);
  EXPECT_THAT(repaired.actions, IsEmpty());
  EXPECT_EQ(repaired.mesh.vertices, torus.vertices);
  EXPECT_EQ(repaired.mesh.faces, torus.faces);
}

TEST(RepairMesh, WeldsAnExplodedMesh) {
  const RepairedMesh repaired = RepairMesh(Exploded(kBox));
  EXPECT_TRUE(CheckMesh(repaired.mesh).watertight);
  EXPECT_EQ(repaired.mesh.NumVertices(), 8);
  EXPECT_THAT(repaired.actions, ElementsAre(HasSubstr("Welded 28 vertices")));
}

TEST(RepairMesh, UndoesAllItCanAtOnce) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    TriangleMesh mesh = Sphere(0.05, 2);
    for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
      if (random() % 3 == 0) std::swap(mesh.faces(0, f), mesh.faces(1, f));
    }
    mesh = WithFace(mesh, mesh.faces(2, 5), mesh.faces(0, 5), mesh.faces(1, 5));
    mesh = WithFace(mesh, 7, 7, 9);
    mesh = WithVertex(mesh, {5, 5, 5});
    if (trial % 2 == 0) mesh = Exploded(mesh);
    mesh = InsideOut(mesh);
    const RepairedMesh repaired = RepairMesh(mesh);
    const MeshReport report = CheckMesh(repaired.mesh);
    EXPECT_TRUE(report.watertight) << ::testing::PrintToString(Describe(report));
    EXPECT_EQ(report.num_vertices, 66);
    EXPECT_EQ(report.num_unreferenced_vertices, 0);
    EXPECT_NEAR(report.volume_m3, SignedVolume(Sphere(0.05, 2)), 1e-15);
  }
}

TEST(RepairMesh, TurnsCavitiesWithTheirSolid) {
  const TriangleMesh shell = Together(Sphere(0.1, 2), InsideOut(Sphere(0.05, 2)));
  const RepairedMesh repaired = RepairMesh(InsideOut(shell));
  EXPECT_TRUE(CheckMesh(repaired.mesh).watertight);
  EXPECT_THAT(repaired.actions, ElementsAre(HasSubstr("Turned 1 closed part outwards")));
  EXPECT_EQ(SignedVolume(repaired.mesh), SignedVolume(shell));
}

// A corner of one face lies on the side of another: exporters fill the slit with a face without
// area. Only to leave it out would open the surface.
TEST(RepairMesh, DividesFacesInPlaceOfFlatOnes) {
  TriangleMesh mesh = WithVertex(kBox, 0.5 * (kBox.vertices.col(0) + kBox.vertices.col(1)));
  // Divide one face at edge (0, 1), leave its neighbor, and fill the slit.
  int found = -1;
  for (int f = 0; f < mesh.NumFaces() && found < 0; ++f) {
    for (int k = 0; k < 3; ++k) {
      if (mesh.faces(k, f) == 0 && mesh.faces((k + 1) % 3, f) == 1) {
        found = f;
        const int apex = mesh.faces((k + 2) % 3, f);
        mesh.faces.col(f) << 0, 8, apex;
        mesh = WithFace(WithFace(mesh, 8, 1, apex), 0, 1, 8);
        break;
      }
    }
  }
  ASSERT_GE(found, 0);
  ASSERT_EQ(CheckMesh(mesh).num_degenerate_faces, 1);
  ASSERT_EQ(CheckMesh(mesh).num_boundary_edges, 0);
  const RepairedMesh repaired = RepairMesh(mesh);
  const MeshReport report = CheckMesh(repaired.mesh);
  EXPECT_TRUE(report.watertight) << ::testing::PrintToString(Describe(report));
  EXPECT_NEAR(report.volume_m3, 0.006, 1e-15);
  EXPECT_THAT(repaired.actions, ElementsAre(HasSubstr("Removed 1 face without area")));
}

TEST(RepairMesh, EndsOnAnyMess) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 200; ++trial) {
    TriangleMesh mesh;
    mesh.vertices.resize(3, 12);
    mesh.faces.resize(3, 40);
    // A small lattice: many points on lines, doubles, crossings.
    for (double& value : mesh.vertices.reshaped()) value = 0.1 * static_cast<double>(random() % 3);
    for (int& id : mesh.faces.reshaped()) id = static_cast<int>(random() % 12);
    try {
      const RepairedMesh repaired = RepairMesh(mesh);
      const MeshReport report = CheckMesh(repaired.mesh);
      EXPECT_EQ(report.num_duplicate_vertices, 0);
      EXPECT_EQ(report.num_unreferenced_vertices, 0);
    } catch (const Error&) {
    }
  }
}

TEST(CheckMesh, TakesALargeMeshInSeconds) {
  const TriangleMesh mesh = Torus(0.1, 0.05, 800, 400);  // 320,000 vertices
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(CheckMesh(mesh).watertight);
  EXPECT_THAT(RepairMesh(mesh).actions, IsEmpty());
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  EXPECT_LT(elapsed.count(), 20.0);  // about 0.5 s; only a change of complexity may fail
}

}  // namespace
}  // namespace holdfast
