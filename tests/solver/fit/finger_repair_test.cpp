// SPDX-License-Identifier: MIT
#include "solver/fit/finger_repair.h"

#include <cmath>

#include <gtest/gtest.h>

#include "geometry/body/hand_model.h"

namespace holdfast {
namespace {

constexpr int kRepairFrames = 120;
constexpr int kJoint = 3;  // the middle finger's root
constexpr double kRate = 60.0;

// Right fingers that close and open slowly.
class FingerRepairTest : public ::testing::Test {
 protected:
  FingerRepairTest() : hand_(BodyModel::Default(), {}, Side::kRight), axes_(hand_) {
    clip_.frame_rate = kRate;
    clip_.trans.setZero(3, kRepairFrames);
    for (int t = 0; t < kRepairFrames; ++t) {
      HandAngles angles = HandAngles::Zero();
      angles.row(0).setConstant(0.3 + 0.3 * std::sin(0.05 * t));
      JointPose pose = JointPose::Zero();
      SetFingers(pose, Side::kRight, axes_.PoseOf(axes_.Clamp(angles)));
      clip_.pose.push_back(pose);
    }
  }

  void Bend(int t, double flexion) {
    auto turn = clip_.pose[t].col(HandBegin(Side::kRight) + kJoint);
    turn += axes_.Axes(kJoint) * Eigen::Vector3d(flexion, 0.0, 0.0);
  }
  // The largest angle between fingers of two clips, radians.
  static double MostApart(const Clip& a, const Clip& b) {
    double most = 0.0;
    for (int t = 0; t < a.NumFrames(); ++t) {
      for (int k = 0; k < kJointsPerHand; ++k) {
        const int joint = HandBegin(Side::kRight) + k;
        most = std::max(most,
                        AngleBetween(ExpSO3(a.pose[t].col(joint)), ExpSO3(b.pose[t].col(joint))));
      }
    }
    return most;
  }

  HandModel hand_;
  HandAxes axes_;
  Clip clip_;
};

TEST_F(FingerRepairTest, FingersThatDoNotJumpStayAsTheyAre) {
  const Clip before = clip_;
  const FingerRepair repair = RepairFingers(axes_, clip_);
  EXPECT_TRUE(repair.moves);
  EXPECT_EQ(repair.jump_frames, 0);
  EXPECT_EQ(repair.replaced, 0);
  for (int t = 0; t < kRepairFrames; ++t) EXPECT_EQ(before.pose[t], clip_.pose[t]);
}

TEST_F(FingerRepairTest, SpikesAndBurstsGoAndTheMotionBelowThemComesBack) {
  const Clip truth = clip_;
  Bend(30, 2.2);
  for (int t = 60; t < 65; ++t) Bend(t, -1.7);  // a burst that a filter has smeared
  Bend(65, -0.8);
  Bend(66, -0.3);
  EXPECT_EQ(FingerJumpFrames(clip_, Side::kRight), 4);
  EXPECT_EQ(FingerJumpFrames(clip_, Side::kLeft), 0);
  EXPECT_GT(MostApart(truth, clip_), 1.6);
  const FingerRepair repair = RepairFingers(axes_, clip_);
  EXPECT_EQ(repair.jump_frames, 4);
  EXPECT_EQ(repair.replaced, 7);  // that of 0.3 is as fast as a finger
  EXPECT_EQ(FingerJumpFrames(clip_, Side::kRight), 0);
  EXPECT_LT(MostApart(truth, clip_), 0.3);
  // The other hand is not touched.
  for (int t = 0; t < kRepairFrames; ++t) {
    EXPECT_EQ(FingersOf(truth.pose[t], Side::kLeft), FingersOf(clip_.pose[t], Side::kLeft));
  }
}

TEST_F(FingerRepairTest, AStepIsSpreadOverAsFewFramesAsItTakes) {
  const Clip before = clip_;
  for (int t = 70; t < kRepairFrames; ++t) Bend(t, 0.9);
  const Clip stepped = clip_;
  EXPECT_EQ(FingerJumpFrames(clip_, Side::kRight), 1);
  const FingerRepair repair = RepairFingers(axes_, clip_);
  EXPECT_LE(repair.replaced, 3);  // 52 degrees at 20 a frame
  EXPECT_EQ(FingerJumpFrames(clip_, Side::kRight), 0);
  const auto turn = [&](const Clip& clip, int t) {
    return Eigen::Vector3d(clip.pose[t].col(HandBegin(Side::kRight) + kJoint));
  };
  EXPECT_LT((turn(clip_, 60) - turn(before, 60)).norm(), 0.05);
  EXPECT_LT((turn(clip_, 80) - turn(stepped, 80)).norm(), 0.05);
}

TEST_F(FingerRepairTest, PosturesThatNoHandReachesAreDrawnIntoTheRange) {
  const auto excess = [&] {
    return axes_.LimitExcess(axes_.AnglesOf(FingersOf(clip_.pose[100], Side::kRight)));
  };
  for (int t = 80; t < kRepairFrames; ++t) Bend(t, -1.4);  // backwards, and it stays so
  const double before = excess();
  RepairFingers(axes_, clip_);
  EXPECT_EQ(FingerJumpFrames(clip_, Side::kRight), 0);
  EXPECT_GT(before, 0.5);
  EXPECT_LT(excess(), 0.12 * before);
}

TEST_F(FingerRepairTest, ClipsWithoutFingersOrWithOneFrameAreToldAndLeft) {
  for (JointPose& pose : clip_.pose) pose.setZero();
  EXPECT_FALSE(RepairFingers(axes_, clip_).moves);
  clip_ = Slice(clip_, 0, 1);
  EXPECT_FALSE(RepairFingers(axes_, clip_).moves);
  EXPECT_EQ(FingerJumpFrames(clip_, Side::kRight), 0);
}

}  // namespace
}  // namespace holdfast
