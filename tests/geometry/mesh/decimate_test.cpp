// SPDX-License-Identifier: MIT
#include "geometry/mesh/decimate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/mesh_parts.h"
#include "geometry/mesh/wrap.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/error_text.h"

namespace holdfast {
namespace {

using testing::Box;
using ::testing::Contains;
using testing::Exploded;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Sheet;
using testing::Sphere;
using testing::Together;
using testing::Torus;
using testing::WithFace;
using testing::WithVertex;

Eigen::Index EulerCharacteristic(const MeshReport& report) {
  return report.num_vertices - report.num_edges + report.num_faces;
}

class DecimateByEachMethod : public ::testing::TestWithParam<DecimateMethod> {
 protected:
  DecimateOptions Options(int vertices) const {
    return {.vertices = vertices, .method = GetParam(), .samples = 20'000};
  }
};

INSTANTIATE_TEST_SUITE_P(All, DecimateByEachMethod, ::testing::ValuesIn(kDecimateMethods),
                         [](const auto& method) {
                           std::string name(Name(method.param));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST_P(DecimateByEachMethod, HitsTheNumberExactlyAndKeepsTheSurface) {
  const TriangleMesh sphere = Sphere(0.05, 5);
  for (const int vertices : {1000, 301, 300, 50}) {
    const DecimateResult result = Decimate(sphere, Options(vertices));
    EXPECT_EQ(result.mesh.NumVertices(), vertices);
    const MeshReport report = CheckMesh(result.mesh);
    EXPECT_TRUE(report.watertight) << ::testing::PrintToString(Describe(report));
    EXPECT_THAT(result.notes, IsEmpty());
    ASSERT_TRUE(result.distance);
    // A sphere of n vertices is off by about r * pi / n.
    EXPECT_LT(result.distance->hausdorff_forward_m, 0.05 * 12.0 / vertices);
    EXPECT_LT(result.distance->hausdorff_backward_m, 0.05 * 12.0 / vertices);
    EXPECT_GT(result.distance->mean_forward_m, 0.0);
  }
}

TEST_P(DecimateByEachMethod, KeepsHandlesAndParts) {
  TriangleMesh ring = Torus(0.05, 0.015, 60, 40);
  MeshReport report = CheckMesh(Decimate(ring, Options(200)).mesh);
  EXPECT_TRUE(report.watertight);
  EXPECT_EQ(EulerCharacteristic(report), 0);

  ring.vertices.row(0).array() += 0.2;
  const TriangleMesh both = Together(ring, Sphere(0.05, 4));
  report = CheckMesh(Decimate(both, Options(300)).mesh);
  EXPECT_TRUE(report.watertight);
  EXPECT_EQ(report.num_components, 2);
  EXPECT_EQ(report.num_vertices, 300);
}

TEST_P(DecimateByEachMethod, KeepsBoundariesInPlace) {
  const TriangleMesh sheet = Sheet(40, 0.005);
  const DecimateResult result = Decimate(sheet, Options(60));
  EXPECT_EQ(result.mesh.NumVertices(), 60);
  const MeshReport report = CheckMesh(result.mesh);
  EXPECT_EQ(report.num_non_manifold_edges, 0);
  EXPECT_EQ(report.num_degenerate_faces, 0);
  EXPECT_EQ(EulerCharacteristic(report), 1);
  EXPECT_LT(result.distance->hausdorff_forward_m, 0.003);  // of a 200 mm sheet
  EXPECT_NEAR(report.area_m2, 0.04, 0.0005);
}

TEST_P(DecimateByEachMethod, IsDeterministicAndIndependentOfUnitAndPlace) {
  const TriangleMesh torus = Torus(0.05, 0.02, 60, 40);
  const DecimateResult once = Decimate(torus, Options(150));
  const DecimateResult again = Decimate(torus, Options(150));
  EXPECT_EQ(once.mesh.vertices, again.mesh.vertices);
  EXPECT_EQ(once.mesh.faces, again.mesh.faces);
  EXPECT_EQ(once.distance->hausdorff_forward_m, again.distance->hausdorff_forward_m);

  TriangleMesh micro = torus;
  micro.vertices *= 0x1p-20;
  const DecimateResult small = Decimate(micro, Options(150));
  EXPECT_EQ(small.mesh.faces, once.mesh.faces);
  EXPECT_LT((small.mesh.vertices * 0x1p20 - once.mesh.vertices).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Decimate, LeavesASmallMeshAsItIs) {
  const TriangleMesh box = Box({0, 0, 0}, {0.1, 0.2, 0.3});
  const DecimateResult result = Decimate(box);
  EXPECT_EQ(result.mesh.vertices, box.vertices);
  EXPECT_EQ(result.mesh.faces, box.faces);
  EXPECT_THAT(result.notes, Contains(HasSubstr("not decimated")));
  EXPECT_LT(result.distance->hausdorff_forward_m, 1e-15);
}

TEST(Decimate, RepairsFirstAndSaysSo) {
  const DecimateResult result = Decimate(Exploded(Sphere(0.05, 4)));
  EXPECT_TRUE(CheckMesh(result.mesh).watertight);
  EXPECT_EQ(result.mesh.NumVertices(), 300);
  EXPECT_THAT(result.notes, Contains(HasSubstr("Welded")));
}

TEST(Decimate, WrapsWhatHasTooManyHandles) {
  // A chain of 40 small rings, each of which needs seven vertices or more.
  TriangleMesh rings = Torus(0.01, 0.003, 24, 12);
  for (int i = 1; i < 40; ++i) {
    TriangleMesh ring = Torus(0.01, 0.003, 24, 12);
    ring.vertices.row(0).array() += 0.03 * i;
    rings = Together(rings, ring);
  }
  EXPECT_THROW(Decimate(rings, {.vertices = 200, .allow_wrap = false, .samples = 0}), Error);
  const DecimateResult result = Decimate(rings, {.vertices = 200, .samples = 0});
  EXPECT_EQ(result.mesh.NumVertices(), 200);
  EXPECT_TRUE(CheckMesh(result.mesh).watertight);
  EXPECT_THAT(result.notes, Contains(HasSubstr("the surface was wrapped first")));
}

TEST(Decimate, WrapsNonManifoldSolidsUnlessForbidden) {
  // Two boxes that share an edge: four faces there, no boundary.
  TriangleMesh two = Together(Box({0, 0, 0}, {0.1, 0.1, 0.1}), Box({0.1, 0.1, 0}, {0.2, 0.2, 0.1}));
  EXPECT_THROW(Decimate(two, {.vertices = 60, .allow_wrap = false}), Error);
  const DecimateResult result = Decimate(two, {.vertices = 60});
  EXPECT_EQ(result.mesh.NumVertices(), 60);
  EXPECT_TRUE(CheckMesh(result.mesh).watertight);
  EXPECT_THAT(result.notes, Contains(HasSubstr("wrapped")));
  EXPECT_NEAR(SignedVolume(result.mesh), 0.002, 0.0001);
}

TEST(Decimate, PartsSurfacesThatTouchInAVertex) {
  TriangleMesh two = Together(Sphere(0.05, 3), Sphere(0.05, 3));
  two.vertices.rightCols(two.NumVertices() / 2).row(0).array() += 0.1;
  const DecimateResult result = Decimate(two, {.vertices = 100});
  EXPECT_TRUE(CheckMesh(result.mesh).watertight);
  EXPECT_EQ(result.mesh.NumVertices(), 100);
  EXPECT_THAT(result.notes, Contains(HasSubstr("touches in a point")));
}

TEST(Decimate, ManyTrianglesAroundAVertexTakeNoTime) {
  // A double cone of 10,000 sectors; 2,000 took a minute.
  const TriangleMesh mesh = testing::DoubleCone(10'000);
  DecimateOptions options;
  options.vertices = 200;
  const DecimateResult result = Decimate(mesh, options);
  EXPECT_EQ(result.mesh.NumVertices(), 200);
  EXPECT_NEAR(SignedVolume(result.mesh), 2.0 * std::numbers::pi / 3.0, 0.01);
  EXPECT_TRUE(CheckMesh(result.mesh).watertight);
}

TEST(Decimate, RefusesWhatItCannotDo) {
  const TriangleMesh sphere = Sphere(0.05, 3);
  EXPECT_THROW(Decimate(sphere, {.vertices = 3}), Error);
  EXPECT_THROW(Decimate(sphere, {.vertices = -300}), Error);
  EXPECT_THROW(Decimate(TriangleMesh{}), Error);
}

// A sphere with a hole around its top.
TriangleMesh OpenSphere() {
  TriangleMesh mesh = Sphere(0.05, 4);
  std::vector<int> kept;
  for (int f = 0; f < mesh.NumFaces(); ++f) {
    if (mesh.vertices(2, mesh.faces(0, f)) < 0.045) kept.push_back(f);
  }
  mesh.faces = mesh.faces(Eigen::all, kept).eval();
  return mesh;
}

// Adds a triangle on each of the first `count` edges of a path along the equator, to one apex.
void AddFins(TriangleMesh& mesh, int count, bool turned) {
  const int apex = static_cast<int>(mesh.NumVertices());
  mesh = WithVertex(mesh, {0.07, 0.01, 0.01});
  int from = 0;  // the octahedron's corner at +x
  for (int i = 0; i < count; ++i) {
    int to = -1;
    for (int f = 0; f < mesh.NumFaces(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const int other = mesh.faces((k + 1) % 3, f);
        if (mesh.faces(k, f) == from && other != apex && mesh.vertices(2, other) == 0.0 &&
            mesh.vertices(1, other) > mesh.vertices(1, from)) {
          to = other;
        }
      }
    }
    ASSERT_GE(to, 0);
    mesh = WithFace(mesh, from, turned ? apex : to, turned ? to : apex);
    from = to;
  }
}

// What Decimate makes of a surface that has a boundary and is not manifold.
TriangleMesh DecimatedOpen(const TriangleMesh& mesh, const char* note, int vertices = 300) {
  EXPECT_GT(CheckMesh(mesh).num_boundary_edges, 0);
  const DecimateResult result = Decimate(mesh, {.vertices = vertices, .samples = 0});
  EXPECT_THAT(result.notes, Contains(HasSubstr(note)));
  EXPECT_EQ(result.mesh.NumVertices(), vertices);
  const MeshReport report = CheckMesh(result.mesh);
  EXPECT_EQ(report.num_non_manifold_edges, 0);
  EXPECT_EQ(report.num_misoriented_edges, 0);
  EXPECT_NEAR(report.area_m2, SurfaceArea(RepairMesh(mesh).mesh), 0.03 * report.area_m2);
  return result.mesh;
}

TEST(Decimate, AFinComesOffAnOpenSurfaceAndLeavesItWhole) {
  const double volume = SignedVolume(OpenSphere());
  for (const auto& [fins, edges] : {std::pair{1, "1 edge"}, {4, "4 edges"}}) {
    for (const bool turned : {false, true}) {
      TriangleMesh mesh = OpenSphere();
      AddFins(mesh, fins, turned);
      const std::string note = std::string("Split the surface along ") + edges;
      const TriangleMesh few = DecimatedOpen(mesh, (note + " of more than two faces").c_str());
      const MeshParts parts = FindParts(few);
      ASSERT_EQ(parts.parts.size(), 2u);
      // One loop of boundary each: an open sphere, a disk.
      EXPECT_EQ(EulerCharacteristic(CheckMesh(few)), 2);
      EXPECT_NEAR(SignedVolume(few), volume, 0.02 * volume);
    }
  }
}

TEST(Decimate, PartsSheetsThatMeetInEdges) {
  // Two rooms below one roof: the wall stands on the line x = 0.15 of a sheet and is parted from
  // it.
  TriangleMesh sheet = Sheet(30, 0.01), wall = Sheet(30, 0.01);
  wall.vertices =
      (Eigen::AngleAxisd(-0.5 * std::numbers::pi, Eigen::Vector3d::UnitY()).toRotationMatrix() *
       wall.vertices)
          .eval();
  wall.vertices.row(0).setConstant(sheet.vertices(0, 15));
  const TriangleMesh standing = DecimatedOpen(Together(sheet, wall), "along 30 edges");
  EXPECT_EQ(FindParts(standing).parts.size(), 2u);
  // Two sheets that cross in a line go through each other.
  TriangleMesh below = wall;
  below.vertices.row(2) *= -1.0;
  const TriangleMesh crossing =
      DecimatedOpen(Together(Together(sheet, wall), below), "along 30 edges");
  EXPECT_EQ(FindParts(crossing).parts.size(), 2u);
}

TEST(Decimate, PartsOpenPartsThatShareAnEdge) {
  TriangleMesh one = OpenSphere();
  TriangleMesh other = one;
  const Eigen::Vector3d a = one.vertices.col(one.faces(0, 40)),
                        b = one.vertices.col(one.faces(1, 40));
  // Half a turn about the edge.
  other.vertices = (Eigen::AngleAxisd(std::numbers::pi, (b - a).normalized()).toRotationMatrix() *
                    (one.vertices.colwise() - 0.5 * (a + b)))
                       .colwise() +
                   0.5 * (a + b);
  TriangleMesh two = Together(one, other);
  const auto weld = [&](int of_one) {
    two.vertices.col(one.NumVertices() + of_one) = one.vertices.col(of_one);
  };
  weld(one.faces(0, 40));
  weld(one.faces(1, 40));
  const TriangleMesh few = DecimatedOpen(two, "along 1 edge");
  EXPECT_EQ(FindParts(few).parts.size(), 2u);
}

TEST(Decimate, OtherFaultsBesideAnEdgeOfThreeFacesAreNoHindrance) {
  std::mt19937 random(3);
  TriangleMesh mesh = OpenSphere();
  const double volume = SignedVolume(mesh);
  AddFins(mesh, 2, false);
  const auto add = [&](int a, int b, int c) { mesh = WithFace(mesh, a, b, c); };
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {  // inconsistent orientation
    if (random() % 3 == 0) std::swap(mesh.faces(0, f), mesh.faces(1, f));
  }
  add(mesh.faces(1, 7), mesh.faces(0, 7), mesh.faces(2, 7));  // doubled
  add(5, 5, 9);                                               // degenerate
  mesh.vertices.conservativeResize(Eigen::NoChange, mesh.NumVertices() + 2);
  mesh.vertices.rightCols<2>() << 0.06, 0.06, 0.0, 0.01, -0.06, -0.05;
  add(mesh.faces(0, 300), static_cast<int>(mesh.NumVertices()) - 2,
      static_cast<int>(mesh.NumVertices()) - 1);  // touches in a vertex
  const TriangleMesh few = DecimatedOpen(mesh, "along 2 edges");
  EXPECT_NEAR(std::abs(SignedVolume(few)), volume, 0.05 * volume);
}

TEST(Decimate, LeavesOutSpecksThatComeOffInTooManyParts) {
  // A speck on each of 120 faces' edges.
  TriangleMesh mesh = OpenSphere();
  const int before = static_cast<int>(mesh.NumVertices());
  mesh.vertices.conservativeResize(Eigen::NoChange, before + 120);
  const Eigen::Index faces = mesh.NumFaces();
  mesh.faces.conservativeResize(Eigen::NoChange, faces + 120);
  for (int i = 0; i < 120; ++i) {
    const int a = mesh.faces(0, 8 * i), b = mesh.faces(1, 8 * i);
    mesh.vertices.col(before + i) = (mesh.vertices.col(a) + mesh.vertices.col(b)) * (0.5 + 1e-4);
    mesh.faces.col(faces + i) << a, b, before + i;
  }
  DecimatedOpen(mesh, "smallest parts, less than 1 % of the area");
}

TEST(Decimate, CutsAnOpenSurfaceWithoutTwoSides) {
  constexpr int kAround = 60, kAcross = 8;
  TriangleMesh strip;
  strip.vertices.resize(3, kAround * (kAcross + 1));
  strip.faces.resize(3, 2 * kAround * kAcross);
  for (int i = 0, f = 0; i < kAround; ++i) {
    for (int j = 0; j <= kAcross; ++j) {
      const double u = 2.0 * std::numbers::pi * i / kAround, w = 0.02 * (2.0 * j / kAcross - 1.0);
      const double r = 0.05 + w * std::cos(0.5 * u);
      strip.vertices.col(i * (kAcross + 1) + j) << r * std::cos(u), r * std::sin(u),
          w * std::sin(0.5 * u);
      if (j == kAcross) continue;
      const auto at = [&](int column, int row) {
        return column < kAround ? column * (kAcross + 1) + row : kAcross - row;
      };
      strip.faces.col(f++) << at(i, j), at(i + 1, j), at(i + 1, j + 1);
      strip.faces.col(f++) << at(i, j), at(i + 1, j + 1), at(i, j + 1);
    }
  }
  DecimatedOpen(strip, "only one side");
}

TEST(PartSheets, MakesAnyMessManifoldWithoutMovingIt) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 500; ++trial) {
    TriangleMesh mesh;
    mesh.vertices.resize(3, 9);
    for (double& value : mesh.vertices.reshaped()) value = 1e-9 * static_cast<double>(random());
    mesh.faces.resize(3, 3 + static_cast<int>(random() % 30));
    for (int& id : mesh.faces.reshaped()) id = static_cast<int>(random() % 9);
    try {
      mesh = RepairMesh(mesh).mesh;
    } catch (const Error&) {
      continue;
    }
    TriangleMesh parted = mesh;
    PartSheets(parted);
    const MeshReport report = CheckMesh(parted);
    EXPECT_EQ(report.num_non_manifold_edges, 0);
    EXPECT_EQ(report.num_misoriented_edges, 0);
    EXPECT_EQ(parted.NumFaces(), mesh.NumFaces());
    EXPECT_EQ(SurfaceArea(parted), SurfaceArea(mesh));
  }
}

TEST(Decimate, SaysAtOnceThatThereAreTooManyLooseParts) {
  // Farther apart than a wrap bridges: without looking for them this takes a second and more.
  TriangleMesh crumbs;
  for (int i = 0; i < 125; ++i) {
    const Eigen::Vector3d place(i % 5, i / 5 % 5, i / 25);
    const TriangleMesh crumb = Box(place, place + Eigen::Vector3d::Constant(0.5));
    crumbs = i == 0 ? crumb : Together(crumbs, crumb);
  }
  const auto refused = [](const TriangleMesh& mesh) {
    return testing::ErrorText([&] { Decimate(mesh, {.vertices = 300, .samples = 0}); });
  };
  EXPECT_THAT(refused(crumbs), HasSubstr("its 125 loose parts need at least 500"));
  // Near each other they are wrapped together.
  TriangleMesh near = crumbs;
  for (int i = 0; i < 125; ++i) {
    near.vertices.middleCols(8 * i, 8).colwise() -=
        0.49 * Eigen::Vector3d(i % 5, i / 5 % 5, i / 25);
  }
  EXPECT_EQ(Decimate(near, {.vertices = 300, .samples = 0}).mesh.NumVertices(), 300);
  // With a hole nothing is wrapped.
  crumbs.faces = crumbs.faces.rightCols(crumbs.NumFaces() - 1).eval();
  EXPECT_THAT(refused(crumbs), HasSubstr("need at least 499"));
}

TEST(Decimate, MethodsHaveNames) {
  for (const DecimateMethod method : kDecimateMethods) {
    EXPECT_EQ(ParseDecimateMethod(Name(method)), method);
  }
  EXPECT_THROW(ParseDecimateMethod("quadric"), Error);
}

TEST(SurfaceDistance, OfTwoConcentricSpheresIsTheirGap) {
  const SurfaceDistance d = MeasureSurfaceDistance(Sphere(0.05, 5), Sphere(0.04, 5), 20'000);
  EXPECT_NEAR(d.hausdorff_forward_m, 0.01, 1e-4);
  EXPECT_NEAR(d.hausdorff_backward_m, 0.01, 1e-4);
  EXPECT_NEAR(d.mean_forward_m, 0.01, 1e-4);
  EXPECT_NEAR(d.mean_backward_m, 0.01, 1e-4);
}

TEST(SurfaceDistance, OneThingIsTheSameHoweverFinely) {
  const TriangleMesh ball = Sphere(0.05, 5);
  EXPECT_TRUE(SameSurface(ball, Sphere(0.05, 3)));
  EXPECT_TRUE(SameSurface(Sphere(0.05, 3), ball));
  EXPECT_FALSE(SameSurface(ball, Sphere(0.055, 5)));
  TriangleMesh moved = ball;
  moved.vertices.row(0).array() += 0.005;
  EXPECT_FALSE(SameSurface(ball, moved));
  EXPECT_FALSE(SameSurface(ball, Box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05})));  // the same box
}

TEST(SurfaceDistance, SamplesAreEvenByArea) {
  // One face holds 0.9 of the area.
  TriangleMesh mesh;
  mesh.vertices.resize(3, 6);
  mesh.vertices << 0, 0.9, 0, 5, 5.1, 5, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0;
  mesh.faces.resize(3, 2);
  mesh.faces << 0, 3, 1, 4, 2, 5;
  const Eigen::Matrix3Xd points = SampleSurface(mesh, 10'000);
  EXPECT_NEAR(static_cast<double>((points.row(0).array() < 2.0).count()), 9000.0, 1.0);
  EXPECT_NEAR(points.leftCols(9000).row(1).mean(), 1.0 / 3.0, 1e-3);
  EXPECT_NEAR(points.leftCols(9000).row(0).mean(), 0.3, 1e-3);
  EXPECT_THROW(SampleSurface(TriangleMesh{}, 10), Error);
}

TEST(WrapSurface, ClosesAnOpenBoxTightly) {
  TriangleMesh box = Box({0, 0, 0}, {0.1, 0.1, 0.1});
  const TriangleMesh wrap = WrapSurface(box, 0.01, 0.0005);
  EXPECT_TRUE(CheckMesh(wrap).watertight);
  const SurfaceDistance d = MeasureSurfaceDistance(box, wrap, 10'000);
  EXPECT_LT(d.hausdorff_backward_m, 0.0006);
  EXPECT_THROW(WrapSurface(TriangleMesh{}, 0.01, 0.0005), Error);
}

}  // namespace
}  // namespace holdfast
