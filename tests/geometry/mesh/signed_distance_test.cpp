// SPDX-License-Identifier: MIT
#include "geometry/mesh/signed_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/triangle_tree.h"
#include "geometry/mesh/winding_number.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using testing::Box;
using testing::BoxDistance;
using testing::InsideOut;
using testing::Sphere;
using testing::Together;
using testing::Torus;

const Eigen::Vector3d kLow(-0.03, 0.01, -0.2);
const Eigen::Vector3d kHigh(0.05, 0.04, 0.1);

Eigen::Vector3d RandomPoint(std::mt19937& random, const Eigen::Vector3d& low,
                            const Eigen::Vector3d& high) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const Eigen::Vector3d t(unit(random), unit(random), unit(random));
  return low + t.cwiseProduct(high - low);
}

Eigen::Vector3d RandomPoint(std::mt19937& random, double reach) {
  return RandomPoint(random, Eigen::Vector3d::Constant(-reach), Eigen::Vector3d::Constant(reach));
}

double ExactWindingNumber(const TriangleMesh& mesh, const Eigen::Vector3d& p) {
  double angle = 0.0;
  for (const auto& face : mesh.faces.colwise()) {
    angle += SolidAngle(mesh.vertices.col(face[0]) - p, mesh.vertices.col(face[1]) - p,
                        mesh.vertices.col(face[2]) - p);
  }
  return angle / (4.0 * std::numbers::pi);
}

double BruteForceDistance(const TriangleMesh& mesh, const Eigen::Vector3d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& face : mesh.faces.colwise()) {
    const TrianglePoint on = ClosestOnTriangle(
        p, mesh.vertices.col(face[0]), mesh.vertices.col(face[1]), mesh.vertices.col(face[2]));
    nearest = std::min(nearest, (p - on.point).norm());
  }
  return ExactWindingNumber(mesh, p) > 0.5 ? -nearest : nearest;
}

TEST(SignedDistance, OfABoxIsItsClosedForm) {
  const SignedDistance distance(Box(kLow, kHigh));
  EXPECT_TRUE(distance.IsWatertight());
  std::mt19937 random(1);
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d p = RandomPoint(random, kLow.array() - 0.1, kHigh.array() + 0.1);
    EXPECT_NEAR(distance.Distance(p), BoxDistance(p, kLow, kHigh), 1e-14);
  }
}

// Points straight off a corner or an edge are where a sign by the face found first goes wrong.
TEST(SignedDistance, HasTheRightSignBesideEveryCornerAndEdge) {
  const SignedDistance distance(Box(kLow, kHigh));
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3i side(i % 3, i / 3 % 3, i / 9);
    Eigen::Vector3d p;
    for (int k = 0; k < 3; ++k) {
      p[k] = side[k] == 0 ? kLow[k] : side[k] == 1 ? 0.5 * (kLow[k] + kHigh[k]) : kHigh[k];
    }
    const Eigen::Vector3d outwards = (side.array() - 1).cast<double>();
    if (outwards.isZero()) continue;
    for (const double step : {1e-3, 1e-6, 1e-9}) {
      EXPECT_GT(distance.Distance(p + step * outwards), 0.0);
      EXPECT_LT(distance.Distance(p - step * outwards), 0.0);
    }
  }
}

// Spikes: at a needle's tip the mean of its faces' normals points inwards, the angle-weighted one
// does not.
TEST(SignedDistance, AgreesWithBruteForceOnSpikes) {
  TriangleMesh mesh = Sphere(0.05, 2);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> stretch(0.3, 3.0);
  for (Eigen::Index v = 0; v < mesh.NumVertices(); ++v) mesh.vertices.col(v) *= stretch(random);
  ASSERT_TRUE(CheckMesh(mesh).watertight);
  const SignedDistance distance(mesh);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p = RandomPoint(random, 0.15);
    EXPECT_NEAR(distance.Distance(p), BruteForceDistance(mesh, p), 1e-13);
  }
}

TEST(SignedDistance, AFanOfManyTrianglesIsNoRecursion) {
  // 200,000 triangles of a double cone have their first corner at one of two places.
  const TriangleMesh mesh = testing::DoubleCone(100'000);
  const SignedDistance distance(mesh);
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p = RandomPoint(random, 1.5);
    // A cone's profile is the line from (1, 0) to (0, 1).
    const Eigen::Vector2d q(p.head<2>().norm(), std::abs(p.z()));
    const double along = std::clamp((q.y() - q.x() + 1.0) / 2.0, 0.0, 1.0);
    const double expected = (q - Eigen::Vector2d(1.0 - along, along)).norm();
    EXPECT_NEAR(distance.Distance(p), q.sum() < 1.0 ? -expected : expected, 1e-6);
  }
}

TEST(SignedDistance, QueryIsConsistent) {
  const TriangleMesh mesh = Torus(0.05, 0.02, 40, 24);
  const SignedDistance distance(mesh);
  std::mt19937 random(3);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d p = RandomPoint(random, 0.1);
    const SignedDistance::Result result = distance.Query(p);
    EXPECT_EQ(result.distance, distance.Distance(p));
    EXPECT_NEAR(result.gradient.norm(), 1.0, 1e-12);
    EXPECT_LT((p - result.distance * result.gradient - result.closest).norm(), 1e-15);
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices.col(mesh.faces(k, result.face));
    };
    EXPECT_LT(
        (ClosestOnTriangle(result.closest, corner(0), corner(1), corner(2)).point - result.closest)
            .norm(),
        1e-15);
    // The gradient is the distance's own, away from where the closest point jumps.
    Eigen::Vector3d numeric;
    constexpr double kStep = 1e-7;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
      numeric[k] = (distance.Distance(p + step) - distance.Distance(p - step)) / (2.0 * kStep);
    }
    if (std::abs(numeric.norm() - 1.0) < 1e-6) {
      EXPECT_LT((numeric - result.gradient).norm(), 1e-4);
    }
  }
}

TEST(SignedDistance, OnTheSurfaceTheGradientIsTheNormal) {
  const SignedDistance distance(Box(kLow, kHigh));
  const Eigen::Vector3d on_top(0.01, 0.02, kHigh.z());
  EXPECT_NEAR(distance.Distance(on_top), 0.0, 1e-16);
  EXPECT_LT((distance.Query(on_top).gradient - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT(
      (distance.Query(kHigh).gradient - Eigen::Vector3d::Constant(1.0 / std::sqrt(3.0))).norm(),
      1e-12);
}

TEST(SignedDistance, KnowsCavities) {
  const TriangleMesh shell = Together(Sphere(0.05, 3), InsideOut(Sphere(0.03, 3)));
  const SignedDistance distance(shell);
  EXPECT_TRUE(distance.IsWatertight());
  EXPECT_GT(distance.Distance(Eigen::Vector3d::Zero()), 0.025);
  EXPECT_LT(distance.Distance({0.04, 0.0, 0.0}), -0.005);
  EXPECT_GT(distance.Distance({0.06, 0.0, 0.0}), 0.005);
}

// The side of the nearest face does where holes are far; beside them the winding number does.
TEST(SignedDistance, OfAMeshWithHolesHasTheSideThatTheExactWindingNumberHas) {
  TriangleMesh open = Torus(0.05, 0.02, 24, 12);
  Eigen::Index kept = 0;
  for (Eigen::Index f = 0; f < open.NumFaces(); ++f) {
    if (f % 97 > 2) open.faces.col(kept++) = open.faces.col(f);
  }
  open.faces.conservativeResize(Eigen::NoChange, kept);
  SignedDistance distance(open);
  ASSERT_FALSE(distance.IsWatertight());
  std::mt19937 random(11);
  int by_side = 0, beside_holes = 0;
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 1500; ++i) {
      const Eigen::Vector3d p = RandomPoint(random, 0.08);
      const double exact = BruteForceDistance(open, p);
      EXPECT_NEAR(distance.Distance(p), exact, 1e-12);
      const double holds = distance.SideHolds(p, exact);
      ++(holds > 0.0 ? by_side : beside_holes);
      EXPECT_LE(holds, std::abs(exact));
      const Eigen::Vector3d way = RandomPoint(random, 1.0);
      EXPECT_EQ(BruteForceDistance(open, p + 0.99 * holds * way.normalized()) < 0.0, exact < 0.0);
    }
    open.vertices.row(1) *= 0.7;  // holes move with the surface
    distance.Move(open.vertices);
  }
  EXPECT_GT(by_side, 300);
  EXPECT_GT(beside_holes, 300);
}

// A solid that is modeled inside another one: one solid, not a cavity.
TEST(SignedDistance, OfASolidWithinASolidIsInsideThroughout) {
  const SignedDistance distance(Together(Sphere(0.05, 3), Sphere(0.03, 3)));
  EXPECT_FALSE(distance.IsWatertight());
  EXPECT_LT(distance.Distance(Eigen::Vector3d(0.001, 0.002, 0.003)), 0.0);
  EXPECT_LT(distance.Distance({0.04, 0.0, 0.0}), 0.0);
  EXPECT_GT(distance.Distance({0.06, 0.0, 0.0}), 0.0);
}

// A batch asks for the winding number only where the surface may lie between two points.
TEST(SignedDistance, BatchesHaveTheSidesOfSingleQueries) {
  TriangleMesh cap = Sphere(0.04, 3);
  cap.faces = Eigen::Matrix3Xi(cap.faces.leftCols(3 * cap.NumFaces() / 4));
  for (const TriangleMesh& mesh : {Together(Sphere(0.05, 3), Sphere(0.03, 3)), cap}) {
    const SignedDistance distance(mesh);
    ASSERT_FALSE(distance.IsWatertight());
    Eigen::Matrix3Xd points(3, 4000);  // a walk, through the surface every now and then
    std::mt19937 random(7);
    points.col(0).setZero();
    for (Eigen::Index i = 1; i < points.cols(); ++i) {
      const Eigen::Vector3d step = RandomPoint(random, 0.004);
      points.col(i) = 0.995 * points.col(i - 1) + step;
    }
    const Eigen::VectorXd found = distance.Distances(points, 1);
    int inside = 0;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      ASSERT_NEAR(found[i], distance.Distance(points.col(i)), 1e-15) << i;
      inside += found[i] < 0.0;
    }
    EXPECT_GT(inside, 100);
    EXPECT_LT(inside, 3900);
  }
}

TEST(SignedDistance, BatchesAreTheSameForAnyNumberOfThreads) {
  const SignedDistance distance(Torus(0.05, 0.02, 40, 24));
  std::mt19937 random(5);
  Eigen::Matrix3Xd points(3, 5000);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    points.col(i) = RandomPoint(random, 0.1);
  }
  const Eigen::VectorXd one = distance.Distances(points, 1);
  EXPECT_EQ(one, distance.Distances(points, 2));
  EXPECT_EQ(one, distance.Distances(points, 7));
  for (Eigen::Index i = 0; i < points.cols(); i += 37) {
    EXPECT_NEAR(one[i], distance.Distance(points.col(i)), 1e-15);
  }
  EXPECT_EQ(distance.Distances(Eigen::Matrix3Xd(3, 0), 4).size(), 0);
}

TEST(SignedDistance, MovedIsAsIfMadeThere) {
  TriangleMesh mesh = Torus(0.05, 0.02, 40, 24);
  TriangleMesh open = mesh;
  open.faces.conservativeResize(Eigen::NoChange, open.NumFaces() - 20);
  SignedDistance distance(mesh), open_distance(open);
  mesh.vertices.row(2) *= 2.0;
  mesh.vertices.colwise() += Eigen::Vector3d(0.1, 0.0, 0.3);
  open.vertices = mesh.vertices;
  distance.Move(mesh.vertices);
  open_distance.Move(mesh.vertices);
  const SignedDistance fresh(mesh), open_fresh(open);
  std::mt19937 random(8);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d p = RandomPoint(random, {0.0, -0.1, 0.2}, {0.2, 0.1, 0.4});
    const SignedDistance::Result result = distance.Query(p, i);
    EXPECT_EQ(result.distance, fresh.Distance(p));
    EXPECT_EQ(result.gradient, fresh.Query(p).gradient);
    EXPECT_EQ(open_distance.Distance(p), open_fresh.Distance(p));
  }
  EXPECT_THROW(distance.Move(Eigen::Matrix3Xd::Zero(3, 5)), Error);
}

TEST(SignedDistance, IsIndependentOfTheUnit) {
  const TriangleMesh mesh = Torus(0.05, 0.02, 30, 20);
  TriangleMesh micro = mesh;
  micro.vertices *= 0x1p-20;
  const SignedDistance distance(mesh);
  const SignedDistance micro_distance(micro);
  std::mt19937 random(6);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p = RandomPoint(random, 0.1);
    EXPECT_EQ(0x1p-20 * distance.Distance(p), micro_distance.Distance(0x1p-20 * p));
  }
}

TEST(SignedDistance, RefusesWhatHasNoSurface) {
  EXPECT_THROW(SignedDistance(TriangleMesh{}), Error);
  TriangleMesh flat = Box(kLow, kHigh);
  flat.vertices.row(0).setZero();
  flat.vertices.row(1).setZero();
  EXPECT_THROW(SignedDistance{flat}, Error);
  TriangleMesh wrong = Box(kLow, kHigh);
  wrong.faces(0, 0) = 8;
  EXPECT_THROW(SignedDistance{wrong}, Error);
  wrong.faces(0, 0) = -1;
  EXPECT_THROW(SignedDistance{wrong}, Error);
  TriangleMesh nan = Box(kLow, kHigh);
  nan.vertices(1, 1) = std::nan("");
  EXPECT_THROW(SignedDistance{nan}, Error);
}

// A soup whose edges cancel is crossed by every ray as often as it winds around its start.
TEST(WindingNumber, OfWhatIsClosedIsWhatARayCrosses) {
  std::mt19937 random(11);
  TriangleMesh shifted = Sphere(0.05, 3);
  shifted.vertices.row(0).array() += 0.04;  // cuts through the other
  const TriangleMesh soups[] = {Box({-1, -1, -1}, {1, 1, 1}),
                                Together(Sphere(0.05, 3), Sphere(0.02, 2)),
                                Together(Sphere(0.05, 3), InsideOut(Sphere(0.02, 2))),
                                Together(Sphere(0.05, 3), shifted), Torus(0.04, 0.015, 24, 12)};
  for (const TriangleMesh& mesh : soups) {
    ASSERT_EQ(ClosingTriangles(mesh).NumFaces(), 0);
    const WindingNumber winding(mesh);
    const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff();
    const Eigen::Vector3d high = mesh.vertices.rowwise().maxCoeff();
    for (int i = 0; i < 2000; ++i) {
      Eigen::Vector3d p = RandomPoint(random, 1.1 * low, 1.1 * high);
      // Rays through corners, along edges and within faces.
      const auto corner = static_cast<Eigen::Index>(random() % mesh.NumVertices());
      if (i % 2 == 0) p[i / 2 % 3] = mesh.vertices(i / 2 % 3, corner);
      if (i % 4 == 0) p[(i / 2 + 1) % 3] = mesh.vertices((i / 2 + 1) % 3, corner);
      if (std::abs(BruteForceDistance(mesh, p)) < 1e-6) continue;
      const int expected = static_cast<int>(std::lround(winding.At(p)));
      for (int axis = 0; axis < 3; ++axis) {
        for (const bool ascending : {false, true}) {
          ASSERT_EQ(winding.Crossings(p, axis, ascending), expected)
              << p.transpose() << ' ' << axis;
        }
      }
    }
  }
}

TEST(ClosingTriangles, CloseWhatIsOpen) {
  std::mt19937 random(12);
  TriangleMesh fin = testing::WithVertex(Sphere(0.05, 3), {0.09, 0.0, 0.01});
  fin = testing::WithFace(fin, fin.faces(0, 7), fin.faces(1, 7),
                          static_cast<int>(fin.NumVertices()) - 1);
  TriangleMesh holes = Sphere(0.05, 3);  // of one face, of many; each with a loop of its own
  holes.faces = holes.faces.middleCols(20, holes.NumFaces() - 21).eval();
  TriangleMesh turned = Sphere(0.05, 2);  // edges that are run through twice the same way
  for (int f = 0; f < turned.NumFaces(); f += 5) std::swap(turned.faces(0, f), turned.faces(1, f));
  for (const TriangleMesh& mesh : {fin, holes, turned, testing::Sheet(6, 0.01)}) {
    TriangleMesh whole = ClosingTriangles(mesh);
    ASSERT_GT(whole.NumFaces(), 0);
    const WindingNumber closing(whole);
    const Eigen::Index first = whole.NumVertices();
    whole = Together(whole, mesh);
    ASSERT_EQ(first + mesh.NumVertices(), whole.NumVertices());
    EXPECT_EQ(ClosingTriangles(whole).NumFaces(), 0);
    const WindingNumber closed(whole);
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector3d p = RandomPoint(random, {-0.07, -0.07, -0.07}, {0.1, 0.07, 0.07});
      EXPECT_NEAR(closed.Crossings(p, i % 3, i % 2 == 0) - closing.At(p),
                  ExactWindingNumber(mesh, p), 0.02);
    }
  }
}

TEST(WindingNumber, IsNearTheExactSum) {
  TriangleMesh mesh = Torus(0.05, 0.02, 60, 40);
  mesh.faces.conservativeResize(Eigen::NoChange, mesh.NumFaces() - 700);
  const WindingNumber winding(mesh);
  std::mt19937 random(7);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d p = RandomPoint(random, 0.12);
    EXPECT_NEAR(winding.At(p), ExactWindingNumber(mesh, p), 0.02);
  }
}

}  // namespace
}  // namespace holdfast
