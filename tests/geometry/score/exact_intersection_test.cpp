// SPDX-License-Identifier: MIT
#include "geometry/score/exact_intersection.h"

#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "geometry/rotation.h"
#include "geometry/score/clipped_volume.h"
#include "geometry/score/contact_metrics.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using testing::Box;
using testing::Sheet;
using testing::Sphere;
using testing::Together;
using testing::Torus;

constexpr double kPi = std::numbers::pi;

TriangleMesh Moved(TriangleMesh mesh, const Eigen::Vector3d& by,
                   const Eigen::Vector3d& turn = Eigen::Vector3d::Zero()) {
  mesh.vertices = (ExpSO3(turn) * mesh.vertices).colwise() + by;
  return mesh;
}

// A capsule along z: half spheres of radius r around z = -h and z = h. Around by `n` sides.
TriangleMesh Capsule(double r, double h, int n) {
  TriangleMesh mesh;
  const int rings = n / 2;  // per half sphere, the equator included
  mesh.vertices.resize(3, 2 * rings * n + 2);
  Eigen::Index v = 0;
  for (int half = 0; half < 2; ++half) {
    for (int i = 0; i < rings; ++i) {
      const double latitude = 0.5 * kPi * (half == 0 ? i + 1 - rings : i) / rings;
      for (int k = 0; k < n; ++k) {
        const double a = 2.0 * kPi * k / n;
        mesh.vertices.col(v++) << r * std::cos(latitude) * std::cos(a),
            r * std::cos(latitude) * std::sin(a), r * std::sin(latitude) + (half == 0 ? -h : h);
      }
    }
  }
  mesh.vertices.col(v) << 0, 0, -h - r;
  mesh.vertices.col(v + 1) << 0, 0, h + r;
  const int south = static_cast<int>(v), north = south + 1;
  mesh.faces.resize(3, 2 * n * (2 * rings - 1) + 2 * n);
  Eigen::Index f = 0;
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    mesh.faces.col(f++) << south, next, k;
    mesh.faces.col(f++) << north, (2 * rings - 1) * n + k, (2 * rings - 1) * n + next;
    for (int ring = 0; ring + 1 < 2 * rings; ++ring) {
      const int a = ring * n + k, b = ring * n + next;
      mesh.faces.col(f++) << a, b, b + n;
      mesh.faces.col(f++) << a, b + n, a + n;
    }
  }
  return mesh;
}

double Exact(const TriangleMesh& a, const TriangleMesh& b) {
  const ExactVolume volume = ExactIntersectionVolume(a, b);
  EXPECT_TRUE(volume.Known()) << Describe(volume.status);
  return volume.volume_m3;
}

TEST(ExactIntersection, BoxInBox) {
  const TriangleMesh a = Box({0, 0, 0}, {2, 3, 4});
  EXPECT_NEAR(Exact(a, Box({1, 1, 1}, {5, 2.5, 9})), 1 * 1.5 * 3, 1e-12);  // corners cut
  EXPECT_NEAR(Exact(a, Box({0.5, 0.5, 0.5}, {1, 1, 1})), 0.125, 1e-15);    // one in the other
  EXPECT_NEAR(Exact(Box({0.5, 0.5, 0.5}, {1, 1, 1}), a), 0.125, 1e-15);    // either way
  EXPECT_EQ(Exact(a, Box({2.1, 0, 0}, {3, 1, 1})), 0.0);                   // apart
  EXPECT_EQ(Exact(a, Box({-1, -1, 4.001}, {3, 4, 5})), 0.0);
}

TEST(ExactIntersection, FacesOnEachOtherCountOnce) {
  const TriangleMesh a = Box({0, 0, 0}, {2, 2, 2});
  EXPECT_NEAR(Exact(a, a), 8.0, 1e-12);
  EXPECT_NEAR(Exact(a, Box({0, 0, 0}, {1, 2, 2})), 4.0, 1e-12);       // five faces shared
  EXPECT_NEAR(Exact(a, Box({0.5, 0.5, 1}, {1, 1, 2})), 0.25, 1e-12);  // one shared, from inside
  EXPECT_NEAR(Exact(a, Box({2, 0, 0}, {3, 2, 2})), 0.0, 1e-12);       // back to back
}

TEST(ExactIntersection, SphereInSphereIsTheLens) {
  const double r1 = 0.05, r2 = 0.04, d = 0.06;
  const TriangleMesh a = Sphere(r1, 6);
  const TriangleMesh b = Moved(Sphere(r2, 6), {0.3 * d, -0.5 * d, std::sqrt(0.66) * d});
  const double lens = kPi * std::pow(r1 + r2 - d, 2) *
                      (d * d + 2 * d * (r1 + r2) - 3 * std::pow(r1 - r2, 2)) / (12 * d);
  EXPECT_NEAR(Exact(a, b) / lens, 1.0, 1e-3);
}

TEST(ExactIntersection, CapsuleThroughPlate) {
  // The plate is thinner than the capsule's straight part: what they share is a prism over the
  // capsule's polygon, and nearly a cylinder.
  const int n = 96;
  const double r = 0.01, t = 0.004;
  const TriangleMesh plate = Box({-0.1, -0.1, -t / 2}, {0.1, 0.1, t / 2});
  const double shared = Exact(Capsule(r, 0.03, n), plate);
  EXPECT_NEAR(shared / (0.5 * n * r * r * std::sin(2 * kPi / n) * t), 1.0, 1e-9);
  EXPECT_NEAR(shared / (kPi * r * r * t), 1.0, 1e-3);
  // Tilted, the section is an ellipse: larger by 1 / cos.
  const double tilted = Exact(Moved(Capsule(r, 0.03, n), {0, 0, 0}, {0.5, 0, 0}), plate);
  EXPECT_NEAR(tilted * std::cos(0.5) / shared, 1.0, 1e-9);
  // Its end stops within a thick plate: cylinder and half sphere.
  const double blind =
      Exact(Moved(Capsule(r, 0.03, n), {0, 0, 0.04}), Box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.02}));
  EXPECT_NEAR(blind / (kPi * r * r * 0.01 + 2.0 / 3.0 * kPi * r * r * r), 1.0, 2e-3);
}

TEST(ExactIntersection, RandomBodiesAgainstFineVoxelsAndAgainstEachOther) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const TriangleMesh shapes[] = {Torus(0.04, 0.015, 24, 12), Sphere(0.04, 3),
                                 Box({-0.03, -0.02, -0.04}, {0.03, 0.02, 0.04})};
  for (int round = 0; round < 12; ++round) {
    const TriangleMesh& a = shapes[round % 3];
    const Eigen::Vector3d by(0.03 * unit(random), 0.03 * unit(random), 0.03 * unit(random));
    const Eigen::Vector3d turn(3 * unit(random), 3 * unit(random), 3 * unit(random));
    const TriangleMesh b = Moved(shapes[(round / 3) % 3], by, turn);
    const double exact = Exact(a, b);
    const double voxel = 1e-3;
    const double counted = IntersectionVolume(SignedDistance(a), SignedDistance(b), voxel);
    // About 10,000 cubes of 1 mm^3 are cut by a surface of 100 cm^2: a few of them by chance.
    EXPECT_NEAR(exact, counted, 400 * voxel * voxel * voxel) << round;
    EXPECT_NEAR(Exact(b, a), exact, 1e-12) << round;
    // What is shared with a body of two parts is the sum of what is shared with each.
    const TriangleMesh far_part = Moved(shapes[1], {0.3, 0, 0});
    EXPECT_NEAR(Exact(a, Together(b, far_part)), exact, 1e-12);
  }
}

TEST(ExactIntersection, SaysWhyItIsUndefined) {
  const TriangleMesh box = Box({-0.01, -0.01, -0.01}, {0.05, 0.05, 0.05});
  EXPECT_EQ(ExactIntersectionVolume(Sheet(4, 0.01), box).status, VolumeStatus::kOpenSurface);
  EXPECT_EQ(ExactIntersectionVolume(box, Sheet(4, 0.01)).status, VolumeStatus::kOpenSurface);
  // Two spheres through each other as one surface: where both are, inside is ambiguous.
  const TriangleMesh crossed =
      Together(Sphere(0.04, 3), Moved(Sphere(0.04, 3), {0.03, 0.002, 0.001}));
  const TriangleMesh around = Box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1});
  EXPECT_EQ(ExactIntersectionVolume(crossed, around).status, VolumeStatus::kSelfIntersecting);
  EXPECT_EQ(ExactIntersectionVolume(around, crossed).status, VolumeStatus::kSelfIntersecting);
  const TriangleMesh at_crossing =
      Moved(Box({-0.006, -0.006, -0.006}, {0.006, 0.006, 0.006}), {0.015, 0.037, 0.0});
  EXPECT_EQ(ExactIntersectionVolume(crossed, at_crossing).status, VolumeStatus::kSelfIntersecting);
  EXPECT_EQ(ExactIntersectionVolume(at_crossing, crossed).status, VolumeStatus::kSelfIntersecting);
  // Away from the crossing the same surface is as good as any.
  const TriangleMesh corner = Moved(Box({-0.01, -0.01, -0.01}, {0.01, 0.01, 0.01}), {-0.04, 0, 0});
  EXPECT_NEAR(Exact(corner, crossed), Exact(corner, Sphere(0.04, 3)), 1e-15);
}

TEST(ExactIntersection, AnOpenHandIsClosedWhenAsked) {
  TriangleMesh open = Box({0, 0, 0}, {1, 1, 1});
  open.faces.conservativeResize(3, 10);
  EXPECT_FALSE(Solid(open).IsClosed());
  const Solid closed(open, true);
  ASSERT_TRUE(closed.IsClosed());
  const Solid other(Box({0.25, 0.25, 0.25}, {2, 0.75, 0.75}));
  EXPECT_NEAR(ExactIntersection(other).With(closed).volume_m3, 0.75 * 0.25, 1e-12);
}

TEST(ExactIntersection, AnOverlapHasTheFacesThatMeetAndThoseInside) {
  const Solid plate(testing::Box({-1.0, -1.0, -0.1}, {1.0, 1.0, 0.1}));
  Solid ball(testing::Sphere(0.05, 3));
  const auto overlap = [&] {
    return FindOverlap(plate, ball, plate.distance.Distances(ball.mesh.vertices), {});
  };
  EXPECT_TRUE(overlap().faces_a.empty());  // all of the ball is inside
  EXPECT_EQ(overlap().faces_b.size(), static_cast<std::size_t>(ball.mesh.NumFaces()));
  ball.mesh.vertices.row(2).array() += 0.3;
  ball.distance.Move(ball.mesh.vertices);
  EXPECT_TRUE(overlap().box.isEmpty());
  EXPECT_EQ(ExactIntersection(plate).With(ball).volume_m3, 0.0);
  ball.mesh.vertices.row(2).array() -= 0.17;
  ball.distance.Move(ball.mesh.vertices);
  const SolidOverlap found = overlap();
  EXPECT_EQ(found.faces_a.size(), 2u);  // of the plate's top; no corner of it is inside
  EXPECT_GT(found.faces_b.size(), 20u);
  EXPECT_LT(found.faces_b.size(), static_cast<std::size_t>(ball.mesh.NumFaces()) / 2);
  const double inside = IntersectionVolume(plate, ball, found, 0.001);
  EXPECT_GT(inside, 0.0);
  EXPECT_EQ(inside, IntersectionVolume(plate.distance, ball.distance, 0.001));
}

}  // namespace
}  // namespace holdfast
