// SPDX-License-Identifier: MIT
#include "geometry/score/contact_metrics.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/mesh/mesh_check.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using testing::Box;
using testing::InsideOut;
using testing::Sheet;
using testing::Sphere;
using testing::Together;

constexpr double kMm = 1e-3;

TEST(ContactMetrics, OfFivePointsAtABox) {
  const SignedDistance box(Box({0, 0, 0}, {0.1, 0.1, 0.1}));
  Eigen::Matrix3Xd hand(3, 5);
  hand.col(0) << 0.05, 0.05, 0.1 - 3 * kMm;    // 3 mm deep: in contact
  hand.col(1) << 0.05, 0.05, 0.1 - 20 * kMm;   // 20 mm deep: inside, not in contact
  hand.col(2) << 0.05, 0.05, 0.1 + 4 * kMm;    // 4 mm away: in contact
  hand.col(3) << 0.05, 0.05, 0.1 + 5.1 * kMm;  // just not
  hand.col(4) << 0.5, 0.5, 0.5;
  const ContactMetrics metrics = ContactFromDistances(box.Distances(hand));
  EXPECT_NEAR(metrics.max_penetration_mm, 20.0, 1e-10);
  EXPECT_NEAR(metrics.mean_penetration_mm, 11.5, 1e-10);
  EXPECT_NEAR(metrics.min_distance_mm, -20.0, 1e-10);
  EXPECT_DOUBLE_EQ(metrics.penetrating_ratio, 0.4);
  EXPECT_DOUBLE_EQ(metrics.contact_ratio, 0.4);
  EXPECT_TRUE(metrics.in_contact);
  EXPECT_EQ(metrics.intersection_volume_cm3, 0.0);

  const ContactMetrics strict =
      ContactFromDistances(box.Distances(hand), {.contact_threshold_mm = 3.5});
  EXPECT_DOUBLE_EQ(strict.contact_ratio, 0.2);

  const ContactMetrics apart = ContactFromDistances(box.Distances(hand.rightCols<2>()));
  EXPECT_FALSE(apart.in_contact);
  EXPECT_EQ(apart.max_penetration_mm, 0.0);
  EXPECT_EQ(apart.mean_penetration_mm, 0.0);
  EXPECT_NEAR(apart.min_distance_mm, 5.1, 1e-10);

  EXPECT_THROW(ContactFromDistances(Eigen::VectorXd()), Error);
}

// The blocks that are decided at once must not change the count.
TEST(ContactMetrics, SharedVolumeCountsAsIfEveryCubeWasTested) {
  TriangleMesh other = testing::Torus(0.03, 0.012, 40, 20);
  other.vertices.colwise() += Eigen::Vector3d(0.02, 0.013, 0.001);
  const SignedDistance a(Sphere(0.035, 3));
  const SignedDistance b(other);
  const double voxel = 0.0017;
  long long expected = 0;
  for (int x = -50; x < 50; ++x) {
    for (int y = -50; y < 50; ++y) {
      for (int z = -50; z < 50; ++z) {
        const Eigen::Vector3d center = voxel * (Eigen::Vector3d(x, y, z).array() + 0.5).matrix();
        expected += a.Distance(center) < 0.0 && b.Distance(center) < 0.0;
      }
    }
  }
  ASSERT_GT(expected, 1000);
  const double volume = IntersectionVolume(a, b, voxel);
  EXPECT_NEAR(volume / std::pow(voxel, 3), static_cast<double>(expected), 1e-6);
  EXPECT_EQ(volume, IntersectionVolume(b, a, voxel));
  EXPECT_EQ(volume, IntersectionVolume(a, b, voxel, 3));
}

TEST(ContactMetrics, SharedVolumeOfDistantSolidsIsZero) {
  TriangleMesh other = Sphere(0.01, 2);
  other.vertices.row(2).array() += 1.0;
  EXPECT_EQ(IntersectionVolume(SignedDistance(Sphere(0.01, 2)), SignedDistance(other), 0.002), 0.0);
  EXPECT_THROW(IntersectionVolume(SignedDistance(Sphere(0.01, 2)), SignedDistance(other), 0.0),
               Error);
}

// A box without its lid, as a hand is open at the wrist.
TEST(ContactMetrics, AHandOpenAtTheWristIsClosed) {
  TriangleMesh hand = Box({0, 0, 0}, {0.02, 0.03, 0.05});
  hand.faces = hand.faces.leftCols(10).eval();
  ASSERT_FALSE(CheckMesh(hand).watertight);
  const TriangleMesh closed = CloseHoles(hand);
  EXPECT_TRUE(CheckMesh(closed).watertight);
  EXPECT_EQ(closed.NumVertices(), 9);
  EXPECT_NEAR(SignedVolume(closed), 0.02 * 0.03 * 0.05, 1e-18);

  const SignedDistance object(Box({-1, -1, -1}, {1, 1, 0.025}));
  const ContactMetrics metrics = MeasureContact(hand, object);
  EXPECT_NEAR(metrics.intersection_volume_cm3, 2 * 3 * 2.5, 0.05 * 15);
  EXPECT_NEAR(metrics.penetrating_ratio, 0.5, 1e-12);  // the cap's vertex is not the hand's
}

TEST(ContactMetrics, HolesThatTouchInAVertexAreClosedApart) {
  TriangleMesh mesh = Sphere(0.05, 2);
  // Faces around one vertex of an octahedron alternate: leaving out two opposite quarters there
  // makes two holes that share that vertex.
  TriangleMesh open = mesh;
  Eigen::Index n = 0;
  for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
    const bool at_pole = (mesh.faces.col(f).array() == 4).any();
    const Eigen::Vector3d middle =
        (mesh.vertices.col(mesh.faces(0, f)) + mesh.vertices.col(mesh.faces(1, f)) +
         mesh.vertices.col(mesh.faces(2, f)));
    if (at_pole && middle.x() * middle.y() > 0.0) continue;
    open.faces.col(n++) = mesh.faces.col(f);
  }
  open.faces.conservativeResize(Eigen::NoChange, n);
  ASSERT_EQ(CheckMesh(open).num_boundary_edges, 6);
  ASSERT_EQ(CheckMesh(open).num_non_manifold_vertices, 1);
  const TriangleMesh closed = CloseHoles(open);
  const MeshReport report = CheckMesh(closed);
  EXPECT_EQ(report.num_boundary_edges, 0);
  EXPECT_EQ(report.num_non_manifold_vertices, 0);
  EXPECT_EQ(report.num_misoriented_edges, 0);
}

TEST(ContactMetrics, ClosingAClosedMeshChangesNothing) {
  const TriangleMesh sphere = Sphere(0.05, 2);
  const TriangleMesh closed = CloseHoles(sphere);
  EXPECT_EQ(closed.vertices, sphere.vertices);
  EXPECT_EQ(closed.faces, sphere.faces);
}

TEST(ContactMetrics, ClosingRefusesWhatHasNoInside) {
  const TriangleMesh box = testing::WithVertex(Box({0, 0, 0}, {1, 1, 1}), {2, 2, 2});
  EXPECT_THROW(CloseHoles(testing::WithFace(box, 0, 1, 8)), Error);  // a fin
  TriangleMesh turned = Sheet(2, 0.1);
  std::swap(turned.faces(1, 0), turned.faces(2, 0));
  EXPECT_THROW(CloseHoles(turned), Error);
}

}  // namespace
}  // namespace holdfast
