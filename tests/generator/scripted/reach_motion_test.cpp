// SPDX-License-Identifier: MIT
#include "generator/scripted/reach_motion.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/walk_statistics/motion_metrics.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "tests/generator/test_body.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

Eigen::Matrix3d Handshake(Side side) {
  return HandOrientation(side, -Vector3d::UnitY(), Vector3d::UnitZ());
}

// Out in front, up, and across the body with a turn of the trunk.
std::vector<ReachKey> Keys(Side side) {
  const double right = side == Side::kRight ? -1.0 : 1.0;
  ReachKey first;
  first.wrist = {0.17 * right, -0.30, 1.03};
  first.hand = Handshake(side);
  first.grasp = 0.0;
  ReachKey up = first;
  up.time_s = 0.8;
  up.wrist = {0.15 * right, -0.30, 1.25};
  up.rest = false;
  up.torso_lean_rad = 0.1;
  up.grasp = 0.6;
  ReachKey across = first;
  across.time_s = 1.8;
  across.wrist = {-0.08 * right, -0.34, 1.10};
  across.torso_twist_rad = -0.4 * right;
  across.weight_shift = -0.5 * right;
  across.knee_give_m = 0.01;
  across.grasp = 1.0;
  return {first, up, across};
}

TEST(ReachMotion, WristGoesThroughItsKeys) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    ScriptedReachOptions options;
    options.side = side;
    const std::vector<ReachKey> keys = Keys(side);
    const Clip clip = MakeReachMotion(DefaultMeasures(), keys, options);
    EXPECT_EQ(clip.NumFrames(), 55);
    const auto frames = JointTrajectory(clip, DefaultMeasures().rest_joints);
    for (const ReachKey& key : keys) {
      const int t = static_cast<int>(std::lround(key.time_s * clip.frame_rate));
      EXPECT_LT((frames[t].col(WristJoint(side)) - key.wrist).norm(), 1e-6);
    }
  }
}

TEST(ReachMotion, FeetStayPlantedOnTheGround) {
  const Clip clip = MakeReachMotion(DefaultMeasures(), Keys(Side::kRight));
  const auto frames = JointTrajectory(clip, DefaultMeasures().rest_joints);
  for (const int joint : {7, 8, 10, 11}) {
    for (const JointPositions& frame : frames) {
      EXPECT_LT((frame.col(joint) - frames[0].col(joint)).norm(), 1e-3);
    }
    EXPECT_GT(frames[0](2, joint), 0.0);
    EXPECT_NEAR(frames[0](2, joint),
                DefaultMeasures().rest_joints(1, joint) - DefaultMeasures().sole_y, 1e-6);
  }
}

TEST(ReachMotion, StartsAndEndsAtRest) {
  ScriptedReachOptions options;
  options.frame_rate = 120.0;
  options.liveliness = 0.0;
  const std::vector<ReachKey> keys = Keys(Side::kRight);
  const Clip clip = MakeReachMotion(DefaultMeasures(), keys, options);
  const auto frames = JointTrajectory(clip, DefaultMeasures().rest_joints);
  const auto speed = [&](std::size_t t) {
    return 120.0 * (frames[t + 1].col(21) - frames[t].col(21)).norm();
  };
  double peak = 0.0;
  for (std::size_t t = 0; t + 1 < frames.size(); ++t) peak = std::max(peak, speed(t));
  EXPECT_GT(peak, 0.2);
  EXPECT_LT(speed(0), 0.002);
  EXPECT_LT(speed(frames.size() - 2), 0.002);
}

TEST(ReachMotion, JointsStayWithinTheirLimitsAndMoveSmoothly) {
  const Clip clip = MakeReachMotion(DefaultMeasures(), Keys(Side::kRight));
  const auto angle = [](const JointPose& pose, int joint) { return pose.col(joint).norm(); };
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const JointPose& pose = clip.pose[t];
    EXPECT_TRUE(pose.allFinite());
    for (const int knee : {4, 5}) {
      EXPECT_LT(angle(pose, knee), 150.0 * kDegree);
      EXPECT_GT(pose(0, knee), 0.0) << "knees do not bend backwards";
    }
    EXPECT_LT(angle(pose, 12) + angle(pose, 15), 80.0 * kDegree);
    for (const int collar : {13, 14}) EXPECT_LT(angle(pose, collar), 35.0 * kDegree);
    for (const int eye : {23, 24}) EXPECT_LT(angle(pose, eye), 40.0 * kDegree);
    if (t == 0) continue;
    for (int j = 0; j < kNumJoints; ++j) {
      EXPECT_LT((pose.col(j) - clip.pose[t - 1].col(j)).norm(), 0.25) << kJointNames[j];
    }
  }
  const auto frames = JointTrajectory(clip, DefaultMeasures().rest_joints);
  const MotionMetrics metrics = MeasureMotion(frames, clip.frame_rate);
  EXPECT_LT(metrics.joint_acceleration_m_s2.max, 10.0);
  EXPECT_LT(metrics.joint_jerk_m_s3.max, 150.0);
}

TEST(ReachMotion, SameSeedSameClipOtherSeedOtherSway) {
  const std::vector<ReachKey> keys = Keys(Side::kRight);
  ScriptedReachOptions options;
  const Clip a = MakeReachMotion(DefaultMeasures(), keys, options);
  const Clip b = MakeReachMotion(DefaultMeasures(), keys, options);
  options.seed = 2;
  const Clip c = MakeReachMotion(DefaultMeasures(), keys, options);
  EXPECT_EQ(a.trans, b.trans);
  EXPECT_NE(a.trans, c.trans);
  for (int t = 0; t < a.NumFrames(); ++t) EXPECT_EQ(a.pose[t], b.pose[t]);
  EXPECT_LT((a.trans - c.trans).cwiseAbs().maxCoeff(), 0.03);
}

TEST(ReachMotion, HeadTurnsTowardsTheHand) {
  std::vector<ReachKey> keys = Keys(Side::kRight);
  keys.erase(keys.begin(), keys.end() - 1);
  keys[0].time_s = 0.0;
  const auto head_yaw = [&] {
    const Clip clip = MakeReachMotion(DefaultMeasures(), keys);
    return clip.pose[0](1, 12) + clip.pose[0](1, 15);
  };
  keys[0].torso_twist_rad = 0.0;
  keys[0].wrist = {0.10, -0.33, 1.15};
  const double left = head_yaw();
  keys[0].wrist = {-0.35, -0.25, 1.15};
  EXPECT_GT(left, head_yaw() + 0.1);
}

TEST(ReachMotion, FarTargetsAreNotForced) {
  std::vector<ReachKey> keys = Keys(Side::kRight);
  keys[1].wrist = {-0.2, -2.0, 1.2};
  const Clip clip = MakeReachMotion(DefaultMeasures(), keys);
  for (const JointPose& pose : clip.pose) EXPECT_TRUE(pose.allFinite());
}

TEST(ReachMotion, RefusesNoKeysAndDisorder) {
  EXPECT_THROW(MakeReachMotion(DefaultMeasures(), {}), Error);
  std::vector<ReachKey> keys = Keys(Side::kRight);
  std::swap(keys[0], keys[2]);
  EXPECT_THROW(MakeReachMotion(DefaultMeasures(), keys), Error);
}

TEST(FingerPose, MirrorsAndClosesTowardsThePalm) {
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  for (const double closure : {0.0, 0.5, 1.0}) {
    const FingerPose right = GraspingFingers(rest, Side::kRight, closure);
    const FingerPose left = GraspingFingers(rest, Side::kLeft, closure);
    for (int k = 0; k < kJointsPerHand; ++k) {
      const Vector3d mirrored(left[3 * k], -left[3 * k + 1], -left[3 * k + 2]);
      EXPECT_LT((right.segment<3>(3 * k) - mirrored).norm(), 1e-6);
      EXPECT_LT(right.segment<3>(3 * k).norm(), 90.0 * kDegree);
    }
  }
  // The last joints of the fingers come nearer to the palm as the hand closes.
  const auto height = [&](double closure, int finger) {
    JointPose pose = JointPose::Zero();
    const FingerPose fingers = GraspingFingers(rest, Side::kRight, closure);
    for (int k = 0; k < kJointsPerHand; ++k)
      pose.col(kRightHandBegin + k) = fingers.segment<3>(3 * k);
    BodyState state;
    ForwardJoints(rest, pose, Vector3d::Zero(), state);
    return state.joints(1, kRightHandBegin + 3 * finger + 2) - state.joints(1, 21);
  };
  for (int finger = 0; finger < 4; ++finger) {
    EXPECT_LT(height(1.0, finger), height(0.0, finger) - 0.02);
  }
}

}  // namespace
}  // namespace holdfast
