// SPDX-License-Identifier: MIT
#include "solver/body_ik/foot_lift.h"

#include <gtest/gtest.h>

#include "generator/wandr/motion_states.h"
#include "solver/body_ik/frame_pose.h"

namespace holdfast {
namespace {

class PointedToes : public ::testing::Test {
 protected:
  PointedToes() {
    frame.local[kLeftFoot] = Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()));
  }
  double Up() const { return Place(body.rest_joints, frame).rotation[kLeftFoot](2, 2); }
  void Level(double share) {
    LevelToes(body.rest_joints, SolePoints(body.rest_joints, body.sole_y), share, frame);
  }

  BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  BodyFrame frame = FrameOf(wandr::StandingPose(body), body.rest_joints.col(0));
};

TEST_F(PointedToes, AreLevelNearTheGround) {
  ASSERT_LT(Up(), -0.4);
  Level(1.0);
  EXPECT_GT(Up(), -0.05);
  const double level = Up();
  Level(1.0);
  EXPECT_NEAR(Up(), level, 0.02) << "level ones stay";
}

TEST_F(PointedToes, StayAsTheyAreFarFromTheGround) {
  frame.pelvis.z() += 0.2;
  const double before = Up();
  Level(1.0);
  EXPECT_EQ(Up(), before);
}

TEST_F(PointedToes, BendByAShare) {
  const double before = Up();
  Level(0.0);
  EXPECT_EQ(Up(), before);
  Level(0.5);
  EXPECT_GT(Up(), before + 0.15);
  EXPECT_LT(Up(), -0.15);
}

TEST_F(PointedToes, BendNoFartherThanToesDo) {
  constexpr double kMost = 0.2;
  frame.local[kLeftFoot] = Eigen::Quaterniond::Identity();
  frame.local[kLeftAnkle] = Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitX()));
  const auto bend = [&] {
    return frame.local[kLeftFoot].angularDistance(Eigen::Quaterniond::Identity());
  };
  LevelToes(body.rest_joints, SolePoints(body.rest_joints, body.sole_y), 1.0, frame, kMost);
  EXPECT_GT(bend(), 0.9 * kMost);
  EXPECT_LE(bend(), kMost + 1e-9);
  Level(1.0);
  EXPECT_GT(bend(), 0.4) << "without a limit they become level";
}

}  // namespace
}  // namespace holdfast
