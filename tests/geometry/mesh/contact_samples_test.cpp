// SPDX-License-Identifier: MIT
#include "geometry/mesh/surface_distance.h"

#include <gtest/gtest.h>

#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/signed_distance.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

double FarthestFrom(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& wanted) {
  double farthest = 0.0;
  for (Eigen::Index i = 0; i < wanted.cols(); ++i) {
    farthest = std::max(farthest, (points.colwise() - wanted.col(i)).colwise().norm().minCoeff());
  }
  return farthest;
}

TEST(ContactSamples, LieOnTheSurfaceAndLeaveNoGap) {
  for (const char* name : {"mug", "knife", "cube"}) {
    const TriangleMesh mesh =
        ReadMesh(std::string(HOLDFAST_MESHES_DIR "/objects/") + name + ".ply");
    const SignedDistance surface(mesh);
    const Eigen::Matrix3Xd points = ContactSamples(mesh, 0.004, 20'000);
    EXPECT_LT(surface.Distances(points).cwiseAbs().maxCoeff(), 1e-7) << name;
    EXPECT_LT(FarthestFrom(points, SampleSurface(mesh, 2000)), 0.006) << name;
    EXPECT_LT(points.cols(), 25'000) << name;
  }
}

TEST(ContactSamples, FollowTheEdgesOfABox) {
  const TriangleMesh box = testing::Box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.05));
  Eigen::Matrix3Xd edge(3, 51);
  for (int k = 0; k <= 50; ++k) edge.col(k) = Eigen::Vector3d(0.001 * k, 0.0, 0.05);
  EXPECT_LT(FarthestFrom(ContactSamples(box, 0.003, 20'000), edge), 0.003);
}

TEST(ContactSamples, StayFewOnALargeObject) {
  TriangleMesh mesh = ReadMesh(HOLDFAST_MESHES_DIR "/objects/sphere.ply");
  mesh.vertices *= 20.0;
  EXPECT_LT(ContactSamples(mesh, 0.003, 5000).cols(), 15'000);
}

}  // namespace
}  // namespace holdfast
