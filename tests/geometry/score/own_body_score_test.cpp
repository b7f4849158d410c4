// SPDX-License-Identifier: MIT
#include "geometry/score/own_body_score.h"

#include <cmath>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "geometry/body/own_body.h"
#include "geometry/rotation.h"
#include "geometry/score/clearance_memory.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

// Arms hanging or held out, and a ball that comes to the belly.
struct BallScene {
  BallScene() : body(BodyModel::Default()) {
    constexpr int kFrames = 5;
    clip.pose.assign(kFrames, JointPose::Zero());
    clip.trans.setZero(3, kFrames);
    clip.object.emplace();
    clip.object->trans.resize(3, kFrames);
    clip.object->orient.setZero(3, kFrames);
    const Eigen::Vector3d belly = body.RestJoints().col(3);
    for (int t = 0; t < kFrames; ++t) {
      clip.object->trans.col(t) = belly + Eigen::Vector3d(0.0, 0.0, 0.4 - 0.1 * t);
    }
    clip.pose[3].col(16) << 0.0, -1.57, 0.0;  // the left upper arm forwards,
    clip.pose[3].col(18) << 0.0, -2.3, 0.0;   // the forearm back into the chest
  }

  BodySurface body;
  Clip clip;
  TriangleMesh ball = testing::Sphere(0.05, 3);
};

// The ball sinks by 10 cm a frame into a block whose top is 8 cm above the last center.
TEST(OwnBodyScore, HasTheDepthInATable) {
  BallScene scene;
  EXPECT_FALSE(MeasureOwnBody(scene.clip, scene.body, &scene.ball, kHoldsRight)->object_in_table);
  const Eigen::Vector3d belly = scene.body.RestJoints().col(3);
  const auto with_block = [&](const Eigen::Vector3d& middle, const Eigen::Vector3d& size) {
    ObjectTrack table;
    table.trans = middle.replicate(1, scene.clip.NumFrames());
    table.orient.setZero(3, scene.clip.NumFrames());
    table.surface = std::make_shared<const TriangleMesh>(testing::Box(-0.5 * size, 0.5 * size));
    scene.clip.table = table;
    return *MeasureOwnBody(scene.clip, scene.body, &scene.ball, kHoldsRight);
  };
  const OwnBodyScore under = with_block(belly - Eigen::Vector3d(0.0, 0.0, 0.12), {1.0, 0.2, 0.4});
  ASSERT_TRUE(under.object_in_table && under.arms_in_table);
  const double expected[] = {0.0, 0.0, 0.0, 30.0, 100.0};  // then the sides are nearer
  for (int t = 0; t < scene.clip.NumFrames(); ++t) {
    EXPECT_NEAR(under.object_in_table->depth_mm[t], expected[t], 1.0) << t;
  }
  EXPECT_EQ(under.arms_in_table->depth_mm[0], 0.0);
  const OwnBodyScore at_hand =
      with_block(scene.body.RestJoints().col(kRightWrist), Eigen::Vector3d::Constant(0.4));
  EXPECT_GT(at_hand.arms_in_table->depth_mm[0], 100.0);
  EXPECT_EQ(at_hand.object_in_table->max_mm, 0.0);
}

TEST(OwnBodyScore, IsTheDeepestOfAllPoints) {
  const BallScene scene;
  const auto score = MeasureOwnBody(scene.clip, scene.body, &scene.ball, kHoldsRight);
  ASSERT_TRUE(score && score->object);
  EXPECT_EQ(score->object_points, scene.ball.NumVertices() + kOwnBodySamples);
  BodyState state;
  const OwnBody for_arms(scene.body, kHoldsRight | kHoldsLeft);
  const OwnBody for_object(scene.body, kHoldsRight);
  for (int t = 0; t < scene.clip.NumFrames(); ++t) {
    Forward(scene.body, scene.clip.pose[t], scene.clip.trans.col(t), state);
    const Eigen::Vector3d low = Eigen::Vector3d::Constant(-3.0), high = -low;
    const OwnBody::Posed arms_posed(for_arms, state.vertices, low, high, 0.3);
    const OwnBody::Posed object_posed(for_object, state.vertices, low, high, 0.3);
    double arms = 0.0, object = 0.0;
    for (const Side side : {Side::kRight, Side::kLeft}) {
      for (const int v : OwnBody::ForearmAndHand(scene.body, side)) {
        const auto touch = arms_posed.Query(state.vertices.col(v));
        if (touch) arms = std::max(arms, touch->depth);
      }
    }
    for (const auto& v : scene.ball.vertices.colwise()) {
      const auto touch = object_posed.Query(v + scene.clip.object->trans.col(t));
      if (touch) object = std::max(object, touch->depth);
    }
    EXPECT_NEAR(score->arms.depth_mm[t], 1e3 * arms, 1e-9) << t;
    // Its vertices are its outermost points, but a face may be nearer to the deepest place.
    EXPECT_GE(score->object->depth_mm[t], 1e3 * object - 1e-9) << t;
    EXPECT_LT(score->object->depth_mm[t], 1e3 * object + 1.0) << t;
  }
  EXPECT_EQ(score->object->depth_mm[0], 0.0);
  EXPECT_GT(score->object->depth_mm[4], 30.0);
  EXPECT_EQ(score->object->worst_frame, 4);
  EXPECT_EQ(score->object->max_mm, score->object->depth_mm[4]);
  EXPECT_GT(score->arms.depth_mm[3], 10.0);
  EXPECT_EQ(score->arms.worst_frame, 3);
  EXPECT_EQ(score->arms.depth_mm[0], 0.0);
  EXPECT_DOUBLE_EQ(score->arms.DeepRatio(2.0), 0.2);
  EXPECT_NEAR(score->arms.mean_mm, score->arms.max_mm / 5.0, 1e-9);
}

TEST(OwnBodyScore, IsTheSameOnAnyNumberOfThreadsAndStops) {
  BallScene scene;
  const std::vector<JointPose> poses = scene.clip.pose;
  for (int k = 0; k < 40; ++k) {
    scene.clip.pose.insert(scene.clip.pose.end(), poses.begin(), poses.end());
  }
  const int frames = static_cast<int>(scene.clip.pose.size());
  scene.clip.trans.setZero(3, frames);
  const auto one = MeasureOwnBody(scene.clip, scene.body, nullptr, 0, 1);
  const auto three = MeasureOwnBody(scene.clip, scene.body, nullptr, 0, 3);
  EXPECT_FALSE(one->object);
  EXPECT_EQ(one->arms.depth_mm, three->arms.depth_mm);
  int seen = 0;
  MeasureOwnBody(scene.clip, scene.body, nullptr, 0, 1, [&](int done, int) {
    seen = done;
    return false;
  });
  EXPECT_GT(seen, 0);
  EXPECT_LT(seen, frames);
}

TEST(BallTree, LeavesOutWhatIsFar) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> side(-1.0, 1.0);
  Eigen::Matrix3Xd points(3, 500);
  for (double& x : points.reshaped()) x = side(random);
  const BallTree tree(points);
  const Eigen::Vector3d place(0.2, 0.1, -0.3);
  std::vector<bool> visited(500, false);
  int visits = 0;
  tree.ForPoints(
      [&](const Eigen::Vector3d& center, double radius, std::size_t ball) {
        EXPECT_LT(ball, tree.NumBalls());
        return (center - place).norm() <= radius + 0.2;
      },
      [&](int column) {
        EXPECT_FALSE(visited[column]);
        visited[column] = true;
        ++visits;
      });
  for (int i = 0; i < 500; ++i) {
    EXPECT_TRUE(visited[i] || (points.col(i) - place).norm() > 0.2);
  }
  EXPECT_LT(visits, 100);
  BallTree(Eigen::Matrix3Xd(3, 0)).ForPoints([](auto&&...) { return true; }, [](int) { FAIL(); });
}

}  // namespace
}  // namespace holdfast
