// SPDX-License-Identifier: MIT
#include <filesystem>

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"
#include "generator/walk_statistics/motion_metrics.h"
#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"

namespace holdfast {
namespace {

class DemoClip : public testing::TestWithParam<const char*> {
 protected:
  Clip clip_ = ReadClip(std::filesystem::path(HOLDFAST_MESHES_DIR) / "clips" / GetParam());
  BodyMeasures body_ = MeasureBody(*BodyModel::Default(), Eigen::VectorXd());
};

TEST_P(DemoClip, IsAFewSecondsHeldByTheRightHand) {
  EXPECT_EQ(clip_.frame_rate, 30.0);
  EXPECT_GE(clip_.NumFrames(), 120);
  EXPECT_LE(clip_.NumFrames(), 160);
  ASSERT_EQ(clip_.holding_hand.size(), clip_.pose.size());
  for (const std::uint8_t hand : clip_.holding_hand) EXPECT_EQ(hand, kHoldsRight);
}

TEST_P(DemoClip, MovesLikeAPersonOnPlantedFeet) {
  const auto frames = JointTrajectory(clip_, body_.rest_joints);
  const MotionMetrics metrics = MeasureMotion(frames, clip_.frame_rate);
  EXPECT_LT(metrics.foot_slide_max_mm_per_frame, 0.01);
  EXPECT_LT(metrics.joint_acceleration_m_s2.max, 6.0);
  EXPECT_LT(metrics.joint_jerk_m_s3.max, 60.0);
}

TEST_P(DemoClip, SolesAreOnTheGround) {
  const BodySurface surface(BodyModel::Default(), Eigen::VectorXd());
  BodyState state;
  for (int t = 0; t < clip_.NumFrames(); t += 20) {
    Forward(surface, clip_.pose[t], clip_.trans.col(t), state);
    EXPECT_NEAR(state.vertices.row(2).minCoeff(), 0.0, 0.005);
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, DemoClip, testing::Values("demo_drink.npz", "demo_inspect.npz"));

}  // namespace
}  // namespace holdfast
