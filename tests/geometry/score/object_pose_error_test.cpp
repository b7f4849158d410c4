// SPDX-License-Identifier: MIT
#include "geometry/score/object_pose_error.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using testing::Box;
using testing::Sheet;
using testing::Sphere;
using testing::Torus;

Eigen::Isometry3d Pose(const Eigen::Vector3d& turn, const Eigen::Vector3d& at) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = ExpSO3(turn);
  pose.translation() = at;
  return pose;
}

TriangleMesh Embedded(const std::string& name) {
  return ReadMesh(HOLDFAST_MESHES_DIR "/objects/" + name + ".ply");
}

TEST(ObjectShape, MomentsAreExact) {
  const SurfaceMoments box = MeasureMoments(Box({1, 2, 3}, {3, 4, 5}));
  EXPECT_NEAR(box.area_m2, 24.0, 1e-12);
  EXPECT_LT((box.center - Eigen::Vector3d(2, 3, 4)).norm(), 1e-12);
  // Of the six faces, four have variance 1/3 along an axis and two have 1.
  EXPECT_LT((box.covariance - 5.0 / 9.0 * Eigen::Matrix3d::Identity()).norm(), 1e-12);
  const SurfaceMoments sheet = MeasureMoments(Sheet(3, 0.1));
  EXPECT_LT((sheet.center - Eigen::Vector3d(0.15, 0.15, 0)).norm(), 1e-12);
}

TEST(ObjectShape, DiameterIsThatOfAllPairs) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 20; ++round) {
    Eigen::Matrix3Xd points(3, 60);
    for (double& x : points.reshaped()) x = normal(random);
    double brute = 0.0;
    for (const auto& a : points.colwise()) {
      for (const auto& b : points.colwise()) brute = std::max(brute, (a - b).norm());
    }
    EXPECT_NEAR(Diameter(points), brute, 1e-12);
  }
  EXPECT_EQ(Diameter(Eigen::Matrix3Xd::Ones(3, 1)), 0.0);
}

TEST(ObjectSymmetry, ShapesWithKnownGroups) {
  EXPECT_TRUE(DetectSymmetry(Sphere(0.03, 4)).sphere);
  EXPECT_EQ(DetectSymmetry(Box({0, 0, 0}, {0.1, 0.1, 0.1})).rotations.size(), 24u);
  EXPECT_EQ(DetectSymmetry(Box({0, 0, 0}, {0.1, 0.1, 0.2})).rotations.size(), 8u);
  EXPECT_EQ(DetectSymmetry(Box({0, 0, 0}, {0.05, 0.1, 0.2})).rotations.size(), 4u);
  const ObjectSymmetry torus = DetectSymmetry(Torus(0.05, 0.01, 48, 24));
  ASSERT_TRUE(torus.axis.has_value());
  EXPECT_NEAR(std::abs(torus.axis->z()), 1.0, 1e-3);
  EXPECT_EQ(torus.rotations.size(), 2u);  // its two ends are alike
}

TEST(ObjectSymmetry, EmbeddedObjects) {
  for (const char* name : {"bottle", "cylinder", "bowl", "wineglass"}) {
    const ObjectSymmetry symmetry = DetectSymmetry(Embedded(name));
    ASSERT_TRUE(symmetry.axis.has_value()) << name;
    EXPECT_NEAR(std::abs(symmetry.axis->z()), 1.0, 1e-3) << name;
    EXPECT_EQ(symmetry.rotations.size(), std::string(name) == "cylinder" ? 2u : 1u) << name;
  }
  EXPECT_TRUE(DetectSymmetry(Embedded("sphere")).sphere);
  EXPECT_EQ(DetectSymmetry(Embedded("cube")).rotations.size(), 24u);
  for (const char* name : {"mug", "camera", "hammer", "teapot", "knife"}) {
    EXPECT_FALSE(DetectSymmetry(Embedded(name)).Any()) << name;
  }
}

TEST(ObjectSymmetry, DoesNotDependOnThePose) {
  TriangleMesh bottle = Embedded("bottle");
  const Eigen::Matrix3d turn = ExpSO3({0.7, -0.4, 1.1});
  bottle.vertices = (turn * bottle.vertices).colwise() + Eigen::Vector3d(0.3, -1.0, 2.0);
  const ObjectSymmetry symmetry = DetectSymmetry(bottle);
  ASSERT_TRUE(symmetry.axis.has_value());
  EXPECT_NEAR(std::abs(symmetry.axis->dot(turn.col(2))), 1.0, 1e-4);
}

TEST(ObjectSymmetry, AnglesAreTakenModuloIt) {
  ObjectSymmetry bottle;
  bottle.axis = Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d R = ExpSO3({0.3, 0.2, 0.1});
  EXPECT_NEAR(AngleModulo(R * ExpSO3({0, 0, 2.0}), R, bottle), 0.0, 1e-12);
  EXPECT_NEAR(AngleModulo(R * ExpSO3({0, 0, 2.0}) * ExpSO3({0.25, 0, 0}), R, bottle), 0.25, 1e-12);
  const Eigen::Matrix3d over = R * ExpSO3({std::numbers::pi, 0, 0});
  EXPECT_NEAR(AngleModulo(over, R, bottle), std::numbers::pi, 1e-7);
  bottle.rotations.push_back(ExpSO3({std::numbers::pi, 0, 0}));
  EXPECT_NEAR(AngleModulo(over, R, bottle), 0.0, 1e-7);
  const ObjectSymmetry none;
  EXPECT_NEAR(AngleModulo(R * ExpSO3({0, 0, 2.0}), R, none), 2.0, 1e-12);
}

TEST(ObjectPoseError, KnownErrors) {
  const TriangleMesh mug = Embedded("mug");
  const ObjectPoseComparer comparer(mug, DetectSymmetry(mug));
  const Eigen::Isometry3d truth = Pose({0.4, 1.0, -0.3}, {0.5, 0.2, 1.0});
  const ObjectPoseError same = comparer.Compare(truth, truth);
  EXPECT_NEAR(same.add_mm, 0.0, 1e-9);
  EXPECT_NEAR(same.add_s_mm, 0.0, 1e-9);
  Eigen::Isometry3d shifted = truth;
  shifted.translation() += Eigen::Vector3d(0.003, 0.0, -0.004);
  const ObjectPoseError shift = comparer.Compare(shifted, truth);
  EXPECT_NEAR(shift.translation_mm, 5.0, 1e-9);
  EXPECT_NEAR(shift.add_mm, 5.0, 1e-9);
  EXPECT_LE(shift.add_s_mm, 5.0);
  EXPECT_NEAR(shift.rotation_deg, 0.0, 1e-5);
  // Turned about its center: the center stays where it is, wherever the origin of the file is.
  const Eigen::Vector3d c = comparer.Symmetry().center;
  const Eigen::Isometry3d turned = truth * Eigen::Translation3d(c) *
                                   Pose({0, 0, 10 * kDegree}, {0, 0, 0}) * Eigen::Translation3d(-c);
  const ObjectPoseError turn = comparer.Compare(turned, truth);
  EXPECT_NEAR(turn.translation_mm, 0.0, 1e-9);
  EXPECT_NEAR(turn.rotation_deg, 10.0, 1e-9);
  EXPECT_NEAR(turn.rotation_modulo_deg, 10.0, 1e-9);  // a mug has a handle
}

TEST(ObjectPoseError, ATurnedBottleIsTheSameBottle) {
  const TriangleMesh bottle = Embedded("bottle");
  const ObjectPoseComparer comparer(bottle, DetectSymmetry(bottle));
  const Eigen::Isometry3d truth = Pose({0.4, 1.0, -0.3}, {0.5, 0.2, 1.0});
  const ObjectPoseError error = comparer.Compare(truth * Pose({0, 0, 1.5}, {0, 0, 0}), truth);
  EXPECT_NEAR(error.rotation_deg, 1.5 / kDegree, 1e-6);
  EXPECT_LT(error.rotation_modulo_deg, 0.1);
  EXPECT_GT(error.add_mm, 20.0);
  EXPECT_LT(error.add_s_mm, 2.0);  // less than the distance between vertices
}

TEST(ObjectPoseError, AddSIsThatOfAllPairs) {
  const TriangleMesh mesh = Torus(0.05, 0.02, 12, 8);
  const ObjectPoseComparer comparer(mesh, {});
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int round = 0; round < 10; ++round) {
    const auto pose = [&] {
      return Pose({2 * unit(random), 2 * unit(random), unit(random)},
                  {0.05 * unit(random), 0.05 * unit(random), 0.05 * unit(random)});
    };
    const Eigen::Isometry3d a = pose(), b = pose();
    double sum = 0.0;
    for (const auto& x : mesh.vertices.colwise()) {
      double nearest = 1e9;
      for (const auto& y : mesh.vertices.colwise()) {
        nearest = std::min(nearest, (a * Eigen::Vector3d(x) - b * Eigen::Vector3d(y)).norm());
      }
      sum += nearest;
    }
    EXPECT_NEAR(comparer.Compare(a, b).add_s_mm,
                1e3 * sum / static_cast<double>(mesh.NumVertices()), 1e-8);
  }
}

}  // namespace
}  // namespace holdfast
