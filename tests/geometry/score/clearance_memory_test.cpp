// SPDX-License-Identifier: MIT
#include "geometry/score/clearance_memory.h"

#include <random>

#include <gtest/gtest.h>

#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

TriangleMesh Shifted(TriangleMesh mesh, const Eigen::Vector3d& by) {
  mesh.vertices.colwise() += by;
  return mesh;
}

TEST(GoesAround, AlsoWhereTheNearestFaceDoesNotTell) {
  const TriangleMesh sphere = testing::Sphere(0.04, 3);
  // Two spheres through each other: the skin of each is inside the other.
  const Solid crossed(testing::Together(sphere, Shifted(sphere, {0.03, 0.002, 0.001})));
  const Eigen::Vector3d before_skin(-0.0115, 0.001, 0.0005);  // of the second, within the first
  EXPECT_GT(crossed.distance.Distance(before_skin), 0.0);
  EXPECT_TRUE(GoesAround(crossed, before_skin));
  EXPECT_FALSE(GoesAround(crossed, {0.015, 0.04, 0.0}));
  EXPECT_FALSE(GoesAround(crossed, {0.2, 0.0, 0.0}));
  TriangleMesh turned = sphere;
  turned.faces.row(0).swap(turned.faces.row(1));
  EXPECT_FALSE(GoesAround(Solid(turned), {0.001, 0.002, 0.003}));
  // From this point all six ways lead through edges.
  const Solid box(testing::Box({-1, -1, -1}, {1, 1, 1}));
  EXPECT_TRUE(GoesAround(box, Eigen::Vector3d::Zero()));
  EXPECT_FALSE(GoesAround(box, {3.0, 0.0, 0.0}));
}

TEST(ClearanceMemory, BoundsHoldWhileAllMoves) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto any = [&](double scale) {
    return Eigen::Vector3d(scale * unit(random), scale * unit(random), scale * unit(random));
  };
  Solid ball(testing::Torus(0.05, 0.02, 24, 12));
  Eigen::Matrix3Xd points(3, 100);
  for (auto point : points.colwise()) point = any(0.08);
  ClearanceMemory memory(ball, 100);
  int known_outside = 0, known_near = 0;
  for (int frame = 0; frame < 30; ++frame) {
    const Eigen::Vector3d step = any(0.001);
    ball.mesh.vertices.colwise() += step;
    ball.distance.Move(ball.mesh.vertices);
    memory.SurfaceMoved(step.norm());
    for (int i = 0; i < 100; ++i) {
      points.col(i) += any(0.001);
      const Eigen::Vector3d point = points.col(i);
      const double distance = ball.distance.Distance(point);
      const double outside = memory.OutsideBy(i, point);
      if (outside > 0.0) {
        EXPECT_LE(outside, distance + 1e-15);
        ++known_outside;
      }
      EXPECT_GE(memory.AtMost(i, point), std::abs(distance) - 1e-15);
      known_near += memory.AtMost(i, point) < 1.0;
      if ((frame + i) % 5 == 0) {
        EXPECT_EQ(memory.Query(i, point).distance, distance);
        EXPECT_EQ(memory.OutsideBy(i, point) > 0.0, distance > 0.0);
      }
    }
  }
  EXPECT_GT(known_outside, 1000);
  EXPECT_GT(known_near, 2000);
}

TEST(ClearanceMemory, WhatNoSurfaceGoesAroundIsOutside) {
  Solid inside_out(testing::Sphere(0.04, 3));
  inside_out.mesh.vertices.row(0) *= -1.0;
  inside_out.distance.Move(inside_out.mesh.vertices);
  ClearanceMemory memory(inside_out, 2);
  const Eigen::Vector3d beyond(0.05, 0.0, 0.0);
  ASSERT_LT(inside_out.distance.Distance(beyond), 0.0);
  const SignedDistance::Result result = memory.Query(0, beyond);
  EXPECT_GT(result.distance, 0.0);
  EXPECT_GT(result.gradient.x(), 0.9);
  EXPECT_GT(memory.OutsideBy(0, beyond), 0.0);
  // Nothing is taken over of a surface that bounds no volume.
  const Solid open(testing::Sheet(4, 0.01));
  ClearanceMemory of_open(open, 1);
  of_open.Query(0, {0.0, 0.0, 0.1});
  EXPECT_LE(of_open.OutsideBy(0, {0.0, 0.0, 0.1}), 0.0);
}

}  // namespace
}  // namespace holdfast
