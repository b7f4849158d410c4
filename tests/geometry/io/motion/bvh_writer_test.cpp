// SPDX-License-Identifier: MIT
#include "geometry/io/motion/bvh.h"

#include <cmath>
#include <iterator>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/moving_clip.h"

namespace holdfast {
namespace {

using testing::MakeMovingClip;

Eigen::Vector3d YUp(const Eigen::Vector3d& p) { return {p.x(), p.z(), -p.y()}; }

void ExpectSameJoints(const Clip& clip, const BodySurface& surface) {
  const SourceMotion motion = ParseBvh(BvhText(clip, surface), "text");
  ASSERT_EQ(motion.NumJoints(), kNumJoints);
  ASSERT_EQ(motion.NumFrames(), clip.NumFrames());
  EXPECT_EQ(motion.frame_rate, clip.frame_rate);
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(surface.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    for (int k = 0; k < kNumJoints; ++k) {
      const int j = FindJoint(motion.joint_names[k]).value();
      EXPECT_LT((motion.positions[t].col(k) - YUp(state.joints.col(j))).norm(), 1e-6)
          << kJointNames[j] << " in frame " << t;
    }
  }
}

TEST(BvhWriter, JointsOfTheTextAreThoseOfTheClip) {
  const BodySurface surface(BodyModel::Default());
  ExpectSameJoints(MakeMovingClip(40, 1), surface);
}

TEST(BvhWriter, JointsAreRightWhereEulerAnglesAreSingular) {
  const BodySurface surface(BodyModel::Default());
  Clip clip = MakeMovingClip(9, 2);
  for (int t = 0; t < 9; ++t) {
    // About x by exactly, and by almost, a quarter turn either way; and half turns.
    const double angle = std::numbers::pi / 2 + 1e-7 * (t - 4);
    clip.pose[t].col(16) << angle, 0, 0;
    clip.pose[t].col(17) << -angle, 0, 0;
    clip.pose[t].col(18) << 0, std::numbers::pi, 0;
    clip.pose[t].col(19) << 0, 0, -std::numbers::pi;
  }
  ExpectSameJoints(clip, surface);
}

// Curves that jump by a turn make programs spin limbs between frames.
TEST(BvhWriter, AnglesGoOnSmoothly) {
  const BodySurface surface(BodyModel::Default());
  Clip clip = MakeMovingClip(1, 3);
  const int num_frames = 80;
  clip.pose.assign(num_frames, JointPose::Zero());
  clip.trans = Eigen::Matrix3Xd::Zero(3, num_frames);
  for (int t = 0; t < num_frames; ++t) clip.pose[t].col(16) << 0, 0.15 * t, 0;  // about two turns
  const std::string text = BvhText(clip, surface);
  std::istringstream lines(text.substr(text.find("Frame Time")));
  std::string line;
  std::getline(lines, line);
  std::vector<double> previous;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::vector<double> values((std::istream_iterator<double>(words)), {});
    ASSERT_EQ(values.size(), 3u + 3u * kNumJoints);
    for (std::size_t k = 0; k < previous.size(); ++k) {
      EXPECT_LT(std::abs(values[k] - previous[k]), 9);
    }
    previous = values;
  }
}

}  // namespace
}  // namespace holdfast
