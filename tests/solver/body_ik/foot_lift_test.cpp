// SPDX-License-Identifier: MIT
#include "solver/body_ik/foot_lift.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "solver/body_ik/frame_pose.h"

namespace holdfast {
namespace {

// Somebody glides forwards by `stride_m`, the right foot hardly off the ground.
class GlidingFeet : public ::testing::Test {
 protected:
  std::vector<BodyFrame> Glide(double stride_m) const {
    std::vector<BodyFrame> frames(kFrames, standing);
    for (int t = 0; t < kFrames; ++t) {
      frames[t].pelvis.y() -= stride_m * t / (kFrames - 1);
    }
    return frames;
  }
  // The left foot carries throughout, or does not while the right one is in the air.
  std::vector<SoleBits> Contacts(bool carried) const {
    std::vector<SoleBits> contacts(kFrames, carried ? kLeftSole : SoleBits{0});
    contacts.front() = contacts.back() = kLeftSole | kRightSole;
    return contacts;
  }
  double Highest(const std::vector<BodyFrame>& frames, int foot) const {
    double highest = 0.0;
    for (const BodyFrame& frame : frames) {
      const Soles points = soles.At(Place(body.rest_joints, frame));
      highest = std::max({highest, points(2, 2 * foot), points(2, 2 * foot + 1)});
    }
    return highest;
  }

  static constexpr int kFrames = 16;
  BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  SolePoints soles{body.rest_joints, body.sole_y};
  BodyFrame standing = FrameOf(wandr::StandingPose(body), body.rest_joints.col(0));
};

TEST_F(GlidingFeet, AStrideIsLifted) {
  std::vector<BodyFrame> frames = Glide(1.0);
  const std::vector<BodyFrame> before = frames;
  LiftFeet(body.rest_joints, soles, Contacts(true), frames, {.lift_m = 0.2, .most_bend_rad = 1.5});
  EXPECT_NEAR(Highest(frames, 1), 0.2, 0.01);
  EXPECT_EQ(Highest(frames, 0), Highest(before, 0)) << "the foot that carries stays";
  for (const std::size_t t : {std::size_t{0}, frames.size() - 1}) {
    EXPECT_TRUE(frames[t].local[kRightKnee].isApprox(before[t].local[kRightKnee]));
  }
}

TEST_F(GlidingFeet, ShortStepsLess) {
  std::vector<BodyFrame> frames = Glide(0.45);
  LiftFeet(body.rest_joints, soles, Contacts(true), frames,
           {.lift_m = 0.2, .long_stride_m = 0.9, .most_bend_rad = 1.5});
  EXPECT_NEAR(Highest(frames, 1), 0.1, 0.01);
}

TEST_F(GlidingFeet, WhatIsNoStrideStays) {
  for (const auto& [stride_m, carried] : {std::pair(0.2, true), std::pair(1.0, false)}) {
    std::vector<BodyFrame> frames = Glide(stride_m);
    const double before = Highest(frames, 1);
    LiftFeet(body.rest_joints, soles, Contacts(carried), frames);
    EXPECT_EQ(Highest(frames, 1), before);
  }
}

}  // namespace
}  // namespace holdfast
