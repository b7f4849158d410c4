// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_both.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Standing, both forearms forward, palms facing each other.
JointPose ArmsForward() {
  JointPose pose = JointPose::Zero();
  const auto joint = [&](const char* name) { return pose.col(*FindJoint(name)); };
  joint("pelvis") = 90.0 * kDegree * Eigen::Vector3d::UnitX();
  joint("right_shoulder") = 76.0 * kDegree * Eigen::Vector3d::UnitZ();
  joint("left_shoulder") = -76.0 * kDegree * Eigen::Vector3d::UnitZ();
  joint("right_elbow") = 80.0 * kDegree * Eigen::Vector3d::UnitY();
  joint("left_elbow") = -80.0 * kDegree * Eigen::Vector3d::UnitY();
  return pose;
}

struct Scene {
  explicit Scene(const Eigen::Vector3d& scale)
      : body(BodyModel::Default()),
        right(BodyModel::Default(), {}, Side::kRight),
        left(BodyModel::Default(), {}, Side::kLeft),
        mesh([&] {
          TriangleMesh cube = ReadMesh(HOLDFAST_MESHES_DIR "/objects/cube.ply");
          cube.vertices = scale.asDiagonal() * cube.vertices;
          return cube;
        }()),
        surface(mesh),
        grid(surface, {.cell_m = std::max(0.004, 0.0008 * scale.maxCoeff()), .threads = 2}) {}

  BothHandsGrasp Hold(int threads = 2) const {
    BothHandsOptions options;
    options.threads = threads;
    return HoldInBothHands(right, left, body, ArmsForward(), Eigen::Vector3d(0.1, 0.2, 1.0), mesh,
                           grid, options);
  }

  BodySurface body;
  HandModel right, left;
  TriangleMesh mesh;
  SignedDistance surface;
  DistanceGrid grid;
};

TEST(HoldInBothHands, ABoxTouchesBothHandsOfThePoseThatComesBack) {
  const Scene scene(Eigen::Vector3d(5.0, 4.0, 3.0));  // 30 x 24 x 18 cm
  const BothHandsGrasp grasp = scene.Hold();
  ASSERT_EQ(grasp.status, GraspStatus::kFound);
  EXPECT_GT(grasp.upright, 0.95);
  EXPECT_LT(grasp.in_body_mm, 2.0);

  // From the pose alone, by exact distances.
  BodyState state;
  Forward(scene.body, grasp.pose, Eigen::Vector3d(0.1, 0.2, 1.0), state);
  const Eigen::Isometry3d object_from_world = grasp.world_from_object.inverse();
  std::array<Eigen::Vector3d, 2> outward;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const int h = side == Side::kRight ? 0 : 1;
    const std::vector<int>& ids = scene.body.Model().HandVertexIds(side);
    int touching = 0;
    double deepest = 0.0, nearest = 1.0;
    for (const int i : ids) {
      const SignedDistance::Result query =
          scene.surface.Query(object_from_world * state.vertices.col(i));
      deepest = std::max(deepest, -query.distance);
      touching += query.distance < 0.002;
      if (query.distance < nearest) {
        nearest = query.distance;
        outward[h] = query.gradient;
      }
    }
    EXPECT_LT(deepest, 0.002) << SideName(side);
    EXPECT_GT(touching, 10) << SideName(side);

    // The wrist that the pose has is the one the grasp is relative to.
    const int wrist = WristJoint(side);
    const Eigen::Isometry3d object =
        ObjectInWorld(grasp.hands[h], state.world_rotation[wrist], state.joints.col(wrist));
    EXPECT_LT((object.translation() - grasp.world_from_object.translation()).norm(), 2e-3);
    EXPECT_LT((object.linear() - grasp.world_from_object.linear()).norm(), 1e-3);

    // Elbow and wrist within what arms do.
    const Limb arm = Arm(side);
    EXPECT_TRUE(SolveWrist(scene.body.RestJoints(), side, state.world_rotation[arm.middle],
                           state.world_rotation[wrist])
                    .reached);
    const Eigen::Vector3d upper = state.joints.col(arm.middle) - state.joints.col(arm.root);
    const Eigen::Vector3d lower = state.joints.col(wrist) - state.joints.col(arm.middle);
    EXPECT_LT(std::atan2(upper.cross(lower).norm(), upper.dot(lower)), arm.max_flexion_rad);
  }
  EXPECT_LT(outward[0].dot(outward[1]), -0.9) << "the hands are not on opposite sides";

  // Nothing but arms and fingers has moved.
  JointPose rest = grasp.pose;
  const JointPose before = ArmsForward();
  for (const Side side : {Side::kRight, Side::kLeft}) {
    SetFingers(rest, side, FingersOf(before, side));
    const Limb arm = Arm(side);
    for (const int joint : {arm.root, arm.middle, arm.end}) rest.col(joint) = before.col(joint);
  }
  EXPECT_EQ(rest, before);
}

TEST(HoldInBothHands, IsTheSameOnAnyNumberOfThreads) {
  const Scene scene(Eigen::Vector3d(4.0, 4.0, 4.0));
  const BothHandsGrasp one = scene.Hold(1), two = scene.Hold(2);
  EXPECT_EQ(one.pose, two.pose);
  EXPECT_EQ(one.world_from_object.matrix(), two.world_from_object.matrix());
}

TEST(HoldInBothHands, SaysSoWhenArmsCannotReachAround) {
  const Scene wardrobe(Eigen::Vector3d(20.0, 20.0, 20.0));  // 1.2 m
  EXPECT_NE(wardrobe.Hold().status, GraspStatus::kFound);
  EXPECT_EQ(wardrobe.Hold().pose, ArmsForward());
}

}  // namespace
}  // namespace holdfast
