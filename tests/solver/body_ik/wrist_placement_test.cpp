// SPDX-License-Identifier: MIT
#include "solver/body_ik/reach_warp.h"

#include <gtest/gtest.h>

#include "generator/body/limb_ik.h"
#include "generator/wandr/motion_states.h"
#include "solver/body_ik/frame_pose.h"

namespace holdfast {
namespace {

class PlacedWrist : public ::testing::Test {
 protected:
  Eigen::Vector3d Wrist(Side side = Side::kRight) const {
    return Place(body.rest_joints, frame).joints.col(WristJoint(side));
  }

  BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  BodyFrame frame = FrameOf(wandr::StandingPose(body), body.rest_joints.col(0));
};

TEST_F(PlacedWrist, StaysWhereItIsAskedToBeAlready) {
  const BodyFrame before = frame;
  EXPECT_LT(PlaceWrist(body.rest_joints, Side::kRight, Wrist(), frame), 1e-9);
  for (int k = 0; k < kNumBodyJoints; ++k) {
    EXPECT_LT(before.local[k].angularDistance(frame.local[k]), 1e-9) << k;
  }
}

TEST_F(PlacedWrist, ReachesInFrontAndLeavesLegsAndTheOtherArmAlone) {
  const BodyFrame before = frame;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    frame = before;
    const double across = side == Side::kRight ? -0.2 : 0.2;
    EXPECT_LT(PlaceWrist(body.rest_joints, side, {across, -0.45, 1.2}, frame), 0.005);
    EXPECT_LT((Wrist(side) - Eigen::Vector3d(across, -0.45, 1.2)).norm(), 0.005);
    for (const int joint : {int{kPelvis}, int{kLeftHip}, int{kRightKnee},
                            kJointParents[WristJoint(OtherSide(side))]}) {
      EXPECT_EQ(before.local[joint].coeffs(), frame.local[joint].coeffs());
    }
  }
}

TEST_F(PlacedWrist, PointsAtWhatIsOutOfReachWithTheElbowBent) {
  const Eigen::Vector3d far(-0.2, -3.0, 1.2);
  const double before = (Wrist() - far).norm();
  const double missed = PlaceWrist(body.rest_joints, Side::kRight, far, frame);
  EXPECT_GT(missed, 1.5);
  EXPECT_LT(missed, before);
  const auto joints = Place(body.rest_joints, frame).joints;
  const Eigen::Vector3d upper = joints.col(kRightElbow) - joints.col(kRightShoulder);
  const Eigen::Vector3d lower = joints.col(kRightWrist) - joints.col(kRightElbow);
  EXPECT_TRUE(joints.allFinite());
  EXPECT_GT(std::acos(upper.normalized().dot(lower.normalized())), 0.03);
}

TEST_F(PlacedWrist, ChangesLittleForATargetThatMovesLittle) {
  BodyFrame other = frame;
  PlaceWrist(body.rest_joints, Side::kRight, {-0.2, -0.45, 1.2}, frame);
  PlaceWrist(body.rest_joints, Side::kRight, {-0.2, -0.45, 1.201}, other);
  for (int k = 0; k < kNumBodyJoints; ++k) {
    EXPECT_LT(frame.local[k].angularDistance(other.local[k]), 0.02) << k;
  }
}

}  // namespace
}  // namespace holdfast
