// SPDX-License-Identifier: MIT
#include "solver/body_ik/arm_ik.h"

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "solver/body_ik/frame_pose.h"

namespace holdfast {
namespace {

class SwingingArms : public ::testing::Test {
 protected:
  // Faces -y. The left leg is ahead by `radians`, the right one behind.
  BodyFrame Stride(double radians) const {
    BodyFrame frame = standing;
    const Eigen::Quaterniond ahead(Eigen::AngleAxisd(-radians, Eigen::Vector3d::UnitX()));
    frame.local[kLeftHip] = ahead * frame.local[kLeftHip];
    frame.local[kRightHip] = ahead.conjugate() * frame.local[kRightHip];
    return frame;
  }
  double Ahead(const BodyFrame& frame, int joint) const {
    return -Place(body.rest_joints, frame).joints(1, joint);
  }

  BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  BodyFrame standing = FrameOf(wandr::StandingPose(body), body.rest_joints.col(0));
};

TEST_F(SwingingArms, EachGoesForwardWithTheOtherLeg) {
  BodyFrame stride = Stride(0.3), still = Stride(0.3);
  ASSERT_GT(Ahead(stride, kLeftAnkle), Ahead(stride, kRightAnkle) + 0.2);
  SwingArms(body.rest_joints, {1.0, 1.0}, 1.0, stride);
  SwingArms(body.rest_joints, {1.0, 1.0}, 0.0, still);
  EXPECT_GT(Ahead(stride, kRightWrist), Ahead(still, kRightWrist) + 0.08);
  EXPECT_LT(Ahead(stride, kLeftWrist), Ahead(still, kLeftWrist) - 0.08);
}

TEST_F(SwingingArms, AnArmThatIsBusyIsLeftAlone) {
  BodyFrame stride = Stride(0.3);
  const BodyFrame before = stride;
  SwingArms(body.rest_joints, {1.0, 0.0}, 1.0, stride);
  EXPECT_EQ(Ahead(stride, kRightWrist), Ahead(before, kRightWrist));
  EXPECT_NE(Ahead(stride, kLeftWrist), Ahead(before, kLeftWrist));
}

TEST_F(SwingingArms, RaisedArmsComeDown) {
  BodyFrame frame;  // arms out to the sides
  frame.pelvis = standing.pelvis;
  frame.local[kPelvis] = standing.local[kPelvis];
  const double before = Place(body.rest_joints, frame).joints(2, kLeftElbow);
  SwingArms(body.rest_joints, {1.0, 1.0}, 0.0, frame);
  EXPECT_LT(Place(body.rest_joints, frame).joints(2, kLeftElbow), before - 0.1);
}

}  // namespace
}  // namespace holdfast
