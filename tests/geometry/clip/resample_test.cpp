// SPDX-License-Identifier: MIT
#include "geometry/clip/resample.h"

#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

// Key frames at 5 Hz: everything moves as `at` says.
Clip KeyClip(int frames, const std::function<Vector3d(int)>& at) {
  Clip clip;
  clip.frame_rate = 5.0;
  clip.trans.resize(3, frames);
  clip.object.emplace();
  clip.object->trans.resize(3, frames);
  clip.object->orient.resize(3, frames);
  for (int t = 0; t < frames; ++t) {
    clip.pose.push_back(JointPose::Zero());
    clip.pose.back().col(5) = at(t);
    clip.trans.col(t) = at(t);
    clip.object->trans.col(t) = at(t);
    clip.object->orient.col(t) = at(t);
    clip.holding_hand.push_back(t % 2 == 0 ? kHoldsRight : kHoldsLeft);
  }
  return clip;
}

Vector3d Wave(int t) {
  return {std::sin(0.9 * t), 0.4 * std::cos(0.7 * t), 0.3 * std::sin(0.5 * t + 1.0)};
}

TEST(ResampleSmoothly, PassesThroughTheKeyFrames) {
  const Clip keys = KeyClip(9, Wave);
  const Clip fine = ResampleSmoothly(keys, 30.0);
  ASSERT_EQ(fine.NumFrames(), 49);
  for (int t = 0; t < 9; ++t) {
    EXPECT_LT((fine.trans.col(6 * t) - keys.trans.col(t)).norm(), 1e-12);
    EXPECT_LT((ExpSO3(fine.pose[6 * t].col(5)) - ExpSO3(keys.pose[t].col(5))).norm(), 1e-9);
    EXPECT_EQ(fine.holding_hand[6 * t], keys.holding_hand[t]);
  }
}

// Velocities of positions and rotations, forwards and backwards from a key frame.
TEST(ResampleSmoothly, VelocityDoesNotJump) {
  const Clip keys = KeyClip(9, Wave);
  const double rate = 5.0 * 2000;
  const Clip fine = ResampleSmoothly(keys, rate), chords = Resample(keys, rate);
  double largest = 0.0, of_chords = 0.0;
  for (int t = 1; t < 8; ++t) {
    const int i = 2000 * t;
    const auto jump = [&](const Clip& clip) {
      const Vector3d before = clip.trans.col(i) - clip.trans.col(i - 1),
                     after = clip.trans.col(i + 1) - clip.trans.col(i);
      const auto R = [&](int k) { return ExpSO3(clip.pose[k].col(5)); };
      const Vector3d turn_before = LogSO3(R(i - 1).transpose() * R(i)),
                     turn_after = LogSO3(R(i).transpose() * R(i + 1));
      return rate * ((after - before).norm() + (turn_after - turn_before).norm());
    };
    largest = std::max(largest, jump(fine));
    of_chords = std::max(of_chords, jump(chords));
  }
  EXPECT_LT(largest, 0.02);
  EXPECT_GT(of_chords, 1.0);
}

TEST(ResampleSmoothly, WhatStaysStillStaysAndNothingOvershoots) {
  const auto step = [](int t) { return Vector3d(t < 4 ? 0.0 : t == 4 ? 0.3 : 1.0, 0, 0); };
  const Clip fine = ResampleSmoothly(KeyClip(8, step), 60.0);
  for (int i = 0; i < fine.NumFrames(); ++i) {
    const double x = fine.trans(0, i), turn = fine.pose[i](0, 5);
    EXPECT_GE(x, -1e-12);
    EXPECT_LE(x, 1.0 + 1e-12);
    if (i <= 36) {
      EXPECT_EQ(x, 0.0) << i;
      EXPECT_NEAR(turn, 0.0, 1e-12) << i;
    }
    EXPECT_LE(turn, 1.0 + 1e-9);
  }
}

TEST(ResampleSmoothly, ErrorsAndShortClips) {
  EXPECT_THROW(ResampleSmoothly(KeyClip(3, Wave), 0.0), Error);
  const Clip one = ResampleSmoothly(KeyClip(1, Wave), 30.0);
  EXPECT_EQ(one.NumFrames(), 1);
  EXPECT_EQ(one.trans.col(0), Wave(0));
}

TEST(Resample, IsTheShortestArcBetweenFrames) {
  const Clip keys = KeyClip(4, [](int t) { return Vector3d(0.5 * t, 0, 0); });
  const Clip fine = Resample(keys, 10.0);
  ASSERT_EQ(fine.NumFrames(), 7);
  EXPECT_NEAR(fine.pose[3](0, 5), 0.75, 1e-12);
  EXPECT_NEAR(fine.object->orient(0, 5), 1.25, 1e-12);
  // There and back.
  const Clip waves = KeyClip(9, Wave);
  const Clip back = Resample(Resample(waves, 10.0), 5.0);
  ASSERT_EQ(back.NumFrames(), 9);
  for (int t = 0; t < 9; ++t) EXPECT_TRUE(back.pose[t].isApprox(waves.pose[t], 1e-9));
  EXPECT_TRUE(back.trans.isApprox(waves.trans));
  EXPECT_THROW(Resample(keys, 0.0), Error);
}

TEST(ResampleAt, IsTheClipAtThoseTimes) {
  const Clip clip = KeyClip(5, Wave);
  const Clip fine = Resample(clip, 20.0);
  const Clip at = ResampleAt(clip, {0.0, 0.25, 0.25, 3.0, 1.75, 4.0});
  EXPECT_EQ(at.frame_rate, clip.frame_rate);
  const int same[] = {0, 1, 1, 12, 7, 16};
  ASSERT_EQ(at.NumFrames(), 6);
  for (int i = 0; i < 6; ++i) {
    EXPECT_LT((at.trans.col(i) - fine.trans.col(same[i])).norm(), 1e-12);
    EXPECT_LT((at.pose[i] - fine.pose[same[i]]).norm(), 1e-9);
    EXPECT_LT((at.object->orient.col(i) - fine.object->orient.col(same[i])).norm(), 1e-9);
    EXPECT_EQ(at.holding_hand[i], fine.holding_hand[same[i]]);
  }
}

}  // namespace
}  // namespace holdfast
