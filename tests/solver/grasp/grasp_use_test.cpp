// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_use.h"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/mesh/signed_distance.h"
#include "geometry/rotation.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;
using testing::Box;
using testing::Sheet;
using testing::Sphere;
using testing::Together;
using testing::Torus;

// A closed curve of (radius, height) turned about z.
TriangleMesh Revolved(const std::vector<std::pair<double, double>>& curve, int sectors = 48) {
  const auto rings = static_cast<int>(curve.size());
  TriangleMesh mesh;
  mesh.vertices.resize(3, rings * sectors);
  mesh.faces.resize(3, 2 * rings * sectors);
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const double angle = 2.0 * std::numbers::pi * j / sectors;
      const auto& [r, z] = curve[i];
      mesh.vertices.col(i * sectors + j) = Vector3d(r * std::cos(angle), r * std::sin(angle), z);
      const int k = (i + 1) % rings, l = (j + 1) % sectors, f = 2 * (i * sectors + j);
      mesh.faces.col(f) << i * sectors + j, i * sectors + l, k * sectors + j;
      mesh.faces.col(f + 1) << i * sectors + l, k * sectors + l, k * sectors + j;
    }
  }
  return mesh;
}

constexpr double kPoint = 1e-4;  // the radius of an end on the axis

TriangleMesh Cup() {
  return Revolved(
      {{kPoint, 0.0}, {0.035, 0.0}, {0.04, 0.1}, {0.036, 0.1}, {0.031, 0.004}, {kPoint, 0.004}});
}
TriangleMesh Bottle() {
  return Revolved(
      {{kPoint, 0.0}, {0.033, 0.0}, {0.033, 0.13}, {0.013, 0.17}, {0.013, 0.2}, {kPoint, 0.2}});
}
TriangleMesh Bowl() {
  return Revolved(
      {{kPoint, 0.0}, {0.04, 0.0}, {0.075, 0.06}, {0.071, 0.06}, {0.037, 0.005}, {kPoint, 0.005}});
}
TriangleMesh Plate() {
  return Revolved(
      {{kPoint, 0.0}, {0.08, 0.0}, {0.12, 0.018}, {0.12, 0.022}, {0.08, 0.005}, {kPoint, 0.005}});
}
// The head at x = 0.14, across y.
TriangleMesh Hammer() {
  return Together(Box({-0.15, -0.015, -0.012}, {0.13, 0.015, 0.012}),
                  Box({0.12, -0.055, -0.015}, {0.15, 0.05, 0.015}));
}
// The grip goes down along -y, the barrel forward along -x.
TriangleMesh Pistol() {
  return Together(Box({0.0, -0.13, -0.016}, {0.038, 0.02, 0.016}),
                  Box({-0.13, 0.0, -0.035}, {0.045, 0.07, 0.035}));
}
TriangleMesh Block() { return Box({-0.025, -0.05, 0.0}, {0.025, 0.05, 0.17}); }

// Handles are looked for where asked: that is slow.
ObjectUse UseOf(const TriangleMesh& mesh, std::optional<GraspUse> wanted = {},
                bool handles = false) {
  const SignedDistance surface(mesh);
  const DistanceGrid grid(surface, {.cell_m = 0.004, .threads = 2});
  return FindUse(mesh, grid, handles ? FindHandles(grid) : std::vector<Handle>(), wanted);
}

struct Turned {
  Eigen::Matrix3d rotation;
  double scale;
};
std::vector<Turned> Turns(bool any_way) {
  std::vector<Turned> turns;
  for (const double scale : {0.8, 1.0, 1.2}) {
    const Vector3d axis = any_way ? Vector3d(0.6, -0.4, 1.1) : Vector3d(0.0, 0.0, 1.1);
    turns.push_back({ExpSO3(scale * axis), scale});
  }
  return turns;
}
TriangleMesh operator*(const Turned& turned, TriangleMesh mesh) {
  mesh.vertices = turned.scale * turned.rotation * mesh.vertices;
  return mesh;
}
Vector3d At(const Turned& turned, const Vector3d& x) { return turned.scale * turned.rotation * x; }

TEST(FindUse, TakesAHammerByTheEndOfItsHandle) {
  for (const Turned& turned : Turns(true)) {
    const ObjectUse use = UseOf(turned * Hammer());
    ASSERT_EQ(use.kind, GraspUse::kTool) << turned.scale;
    EXPECT_GT(use.thumb.dot(turned.rotation.col(0)), 0.98) << "towards the head";
    EXPECT_GT(use.HoldWeight(At(turned, {-0.09, 0.015, 0.0})), 0.95);
    EXPECT_LT(use.HoldWeight(At(turned, {0.06, 0.015, 0.0})), 0.1);
    EXPECT_LT(use.HoldWeight(At(turned, {0.14, 0.04, 0.0})), 0.01);
  }
}

TEST(FindUse, TakesAPistolByItsGripWithTheHandForward) {
  for (const Turned& turned : Turns(true)) {
    const ObjectUse use = UseOf(turned * Pistol());
    ASSERT_EQ(use.kind, GraspUse::kTool) << turned.scale;
    EXPECT_GT(use.thumb.dot(turned.rotation.col(1)), 0.95) << "index finger at the barrel";
    EXPECT_GT(use.ahead.dot(-turned.rotation.col(0)), 0.9) << "as the barrel points";
    EXPECT_GT(use.up.dot(turned.rotation.col(1)), 0.95);
    EXPECT_GT(use.HoldWeight(At(turned, {0.0, -0.06, 0.0})), 0.95);
    EXPECT_LT(use.HoldWeight(At(turned, {-0.08, 0.04, 0.035})), 0.05);
  }
}

TEST(FindUse, TakesCupsAndBottlesUprightBelowTheRim) {
  for (const Turned& turned : Turns(false)) {
    for (const auto& [mesh, top] : {std::pair{Cup(), 0.1}, std::pair{Bottle(), 0.2}}) {
      const ObjectUse use = UseOf(turned * mesh);
      ASSERT_EQ(use.kind, GraspUse::kVessel) << turned.scale << ' ' << top;
      EXPECT_GT(use.up.z(), 0.99);
      EXPECT_GT(use.up_weight, 1.0);
      EXPECT_GT(use.HoldWeight(At(turned, {0.033, 0.0, 0.05})), 0.95);
      EXPECT_LT(use.HoldWeight(At(turned, {0.013, 0.0, top})), 0.6);
      // Level around it before from above.
      EXPECT_GT(use.OppositionWeight(At(turned, {0.0, 0.0, 0.05}), Vector3d::UnitX()),
                2.0 * use.OppositionWeight(At(turned, {0.0, 0.0, 0.05}), Vector3d::UnitZ()));
      Eigen::Matrix3Xd palm_on_top(3, 2);
      palm_on_top << At(turned, {0.0, 0.0, top + 0.01}), At(turned, {0.0, 0.0, 0.05});
      EXPECT_LT(use.PlaceScore({}, palm_on_top), -0.5);
    }
  }
}

TEST(FindUse, SeesWhichWayIsUpOfALyingCup) {
  Turned lies{ExpSO3(0.5 * std::numbers::pi * Vector3d::UnitY()), 1.0};
  const ObjectUse use = UseOf(lies * Cup());
  ASSERT_EQ(use.kind, GraspUse::kVessel);
  EXPECT_GT(use.up.x(), 0.99);
}

TEST(FindUse, TakesDishesByTheRim) {
  for (const Turned& turned : Turns(false)) {
    for (const auto& [mesh, rim] : {std::pair{Bowl(), Vector3d(0.073, 0.0, 0.055)},
                                    std::pair{Plate(), Vector3d(0.115, 0.0, 0.018)}}) {
      const ObjectUse use = UseOf(turned * mesh);
      ASSERT_EQ(use.kind, GraspUse::kDish) << turned.scale << ' ' << rim.x();
      EXPECT_GT(use.up.z(), 0.99);
      EXPECT_GT(use.HoldWeight(At(turned, rim)), 0.95);
      EXPECT_LT(use.HoldWeight(At(turned, {0.0, 0.0, 0.0})), 0.3);
    }
  }
}

TEST(FindUse, TakesABoxAcrossItsNarrowSide) {
  for (const Turned& turned : Turns(true)) {
    const ObjectUse use = UseOf(turned * Block());
    ASSERT_EQ(use.kind, GraspUse::kBox) << turned.scale;
    ASSERT_EQ(use.press.size(), 1u);
    EXPECT_GT(std::abs(use.press[0].dot(turned.rotation.col(0))), 0.999);
  }
  EXPECT_GT(UseOf(Block()).up_weight, 1.0) << "it stands";
  EXPECT_EQ(UseOf(Turned{Turns(true)[0].rotation, 1.0} * Block()).up_weight, 0.0) << "it does not";
}

TEST(FindUse, TakesAStandingBoxFromTheSideAtMidHeight) {
  for (const Turned& turned : Turns(false)) {
    const ObjectUse use = UseOf(turned * Block());
    ASSERT_EQ(use.kind, GraspUse::kBox) << turned.scale;
    EXPECT_GT(use.thumb.z(), 0.99);
    EXPECT_GT(use.HoldWeight(At(turned, {0.025, 0.02, 0.085})), 0.95);
    EXPECT_LT(use.HoldWeight(At(turned, {0.025, 0.02, 0.17})), 0.5) << "its top edge";
  }
  const ObjectUse wide = UseOf(Box({-0.03, -0.08, 0.0}, {0.03, 0.08, 0.21}));
  EXPECT_GT(wide.HoldWeight({0.03, 0.04, 0.1}), wide.HoldWeight({0.0, 0.0, 0.1})) << "near an edge";
}

TEST(FindUse, TakesAPhoneInThePalmWithItsScreenFree) {
  // Three lenses near one end of the back; the other face is the screen.
  TriangleMesh phone = Box({-0.07, -0.035, 0.0}, {0.07, 0.035, 0.008});
  for (const double y : {-0.02, -0.007}) {
    phone = Together(phone, Box({0.04, y, 0.007}, {0.05, y + 0.01, 0.0095}));
  }
  for (const Turned& turned : Turns(true)) {
    const ObjectUse use = UseOf(turned * phone);
    ASSERT_EQ(use.kind, GraspUse::kPhone) << turned.scale;
    const Eigen::Matrix3d& R = turned.rotation;
    EXPECT_LT(use.palm.dot(R.col(2)), -0.99) << "the palm faces as the screen";
    EXPECT_GT(use.thumb.dot(R.col(0)), 0.99) << "towards the lenses";
    ASSERT_EQ(use.press.size(), 1u);
    EXPECT_GT(std::abs(use.press[0].dot(R.col(1))), 0.99) << "across its width";
    const Eigen::Matrix3Xd over_screen = At(turned, {0.01, 0.0, -0.02});
    const Eigen::Matrix3Xd behind = At(turned, {0.01, 0.0, 0.03});
    EXPECT_EQ(use.InKeepFree(over_screen), 1.0);
    EXPECT_LT(use.PlaceScore({}, over_screen), -1.0);
    EXPECT_EQ(use.InKeepFree(behind), 0.0);
    EXPECT_EQ(use.PlaceScore({}, behind), 0.0);
    EXPECT_NEAR(use.DirectionScore(R.col(0), R.col(1), -R.col(2)),
                use.DirectionScore(R.col(0), -R.col(1), -R.col(2)), 1e-6);
    EXPECT_GT(use.DirectionScore(R.col(0), R.col(1), -R.col(2)),
              use.DirectionScore(R.col(0), R.col(1), R.col(2)) + 1.0);
  }
}

TEST(FindUse, TakesTheUpperFaceOfACardForItsScreen) {
  const ObjectUse use = UseOf(Box({-0.07, -0.035, 0.0}, {0.07, 0.035, 0.008}));
  ASSERT_EQ(use.kind, GraspUse::kPhone);
  EXPECT_GT(use.palm.z(), 0.99);
  EXPECT_TRUE(use.thumb.isZero());
}

// The lens points along x, the body's longer side is along y.
TriangleMesh Camera() {
  TriangleMesh barrel =
      Revolved({{kPoint, 0.0}, {0.03, 0.0}, {0.03, 0.05}, {0.026, 0.05}, {kPoint, 0.04}});
  const Eigen::Matrix3d ahead = ExpSO3(0.5 * std::numbers::pi * Vector3d::UnitY());
  barrel.vertices = (ahead * barrel.vertices).colwise() + Vector3d(0.02, 0.0, 0.045);
  return Together(Box({-0.025, -0.065, 0.0}, {0.025, 0.065, 0.085}), barrel);
}

TEST(FindUse, TakesACameraBesideItsLens) {
  for (const Turned& turned : Turns(false)) {
    const ObjectUse use = UseOf(turned * Camera());
    ASSERT_EQ(use.kind, GraspUse::kCamera) << turned.scale;
    EXPECT_GT(use.ahead.dot(turned.rotation.col(0)), 0.99) << "fingers in front";
    EXPECT_GT(use.thumb.z(), 0.99);
    EXPECT_GT(use.HoldWeight(At(turned, {0.025, -0.055, 0.04})), 0.95);
    EXPECT_LT(use.HoldWeight(At(turned, {0.05, 0.0, 0.075})), 0.1) << "the barrel";
    EXPECT_EQ(use.InKeepFree(At(turned, {0.1, 0.0, 0.05})), 1.0) << "in front of the lens";
    EXPECT_EQ(use.InKeepFree(At(turned, {-0.04, 0.0, 0.045})), 1.0) << "the view";
    EXPECT_EQ(use.InKeepFree(At(turned, {0.03, -0.06, 0.04})), 0.0);
  }
}

TEST(FindUse, TakesACupByItsHandleWithTheThumbUp) {
  TriangleMesh ring = Torus(0.025, 0.005, 48, 16);
  const Eigen::Matrix3d upright = ExpSO3(0.5 * std::numbers::pi * Vector3d::UnitX());
  ring.vertices = (upright * ring.vertices).colwise() + Vector3d(0.05, 0.0, 0.05);
  const ObjectUse use = UseOf(Together(Cup(), ring), {}, true);
  ASSERT_EQ(use.kind, GraspUse::kHandle);
  EXPECT_GT(use.up.z(), 0.99);
  EXPECT_GT(use.thumb.z(), 0.99);
  EXPECT_LT(use.HoldWeight({0.039, 0.0, 0.1}), 0.1) << "the rim is to drink from";
}

TEST(FindUse, HasNoOpinionOfABall) {
  TriangleMesh blob = Sphere(0.035, 3);
  EXPECT_EQ(UseOf(blob).kind, GraspUse::kAny);
  for (Eigen::Index v = 0; v < blob.NumVertices(); ++v) {
    blob.vertices.col(v) *=
        1.0 + 0.08 * std::sin(90.0 * blob.vertices(0, v)) * std::cos(70.0 * blob.vertices(1, v));
  }
  EXPECT_EQ(UseOf(blob).kind, GraspUse::kAny);
  const ObjectUse any;
  EXPECT_EQ(any.HoldWeight(Vector3d::Ones()), 1.0);
  EXPECT_EQ(any.DirectionScore(Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()), 0.0);
  EXPECT_EQ(any.PlaceScore({}, Eigen::Matrix3Xd::Random(3, 5)), 0.0);
}

TEST(FindUse, IsToldWhatToSee) {
  EXPECT_EQ(UseOf(Hammer(), GraspUse::kAny).kind, GraspUse::kAny);
  EXPECT_EQ(UseOf(Bottle(), GraspUse::kHandle).kind, GraspUse::kAny) << "it has none";
  EXPECT_EQ(UseOf(Block(), GraspUse::kVessel).kind, GraspUse::kVessel);
}

TEST(FindUse, LivesWithOpenMeshesAndPieces) {
  const TriangleMesh cup = Cup();
  TriangleMesh open = cup;  // every third face
  open.faces = cup.faces(Eigen::all, Eigen::seq(0, cup.NumFaces() - 1, 3));
  TriangleMesh pieces =
      Together(Hammer(), Turned{Eigen::Matrix3d::Identity(), 0.1} * Sphere(0.05, 2));
  pieces.vertices.rightCols(10).array() += 0.02;
  for (const TriangleMesh& mesh : {open, pieces, Sheet(6, 0.02)}) {
    for (const auto& wanted : {std::optional<GraspUse>(), std::optional(GraspUse::kTool),
                               std::optional(GraspUse::kVessel), std::optional(GraspUse::kBox),
                               std::optional(GraspUse::kDish), std::optional(GraspUse::kHandle),
                               std::optional(GraspUse::kCamera), std::optional(GraspUse::kPhone)}) {
      const ObjectUse use = UseOf(mesh, wanted);
      EXPECT_TRUE(use.up.allFinite() && use.thumb.allFinite() && use.ahead.allFinite());
      EXPECT_NEAR(use.up.norm(), 1.0, 1e-9);
    }
  }
}

}  // namespace
}  // namespace holdfast
