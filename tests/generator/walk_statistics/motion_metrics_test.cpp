// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/motion_metrics.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/generator/test_body.h"

namespace holdfast {
namespace {

// All joints follow x = f(t), 60 Hz, feet at height 0.
template <typename F>
std::vector<JointPositions> Along(F&& f, int num_frames = 60) {
  std::vector<JointPositions> frames;
  for (int t = 0; t < num_frames; ++t) {
    JointPositions joints = JointPositions::Zero();
    joints.row(0).setConstant(f(t / 60.0));
    frames.push_back(joints);
  }
  return frames;
}

TEST(MotionMetrics, StandingStillIsZero) {
  const MotionMetrics m = MeasureMotion(Along([](double) { return 1.0; }), 60.0);
  EXPECT_EQ(m.joint_acceleration_m_s2.max, 0.0);
  EXPECT_EQ(m.joint_jerk_m_s3.max, 0.0);
  EXPECT_EQ(m.foot_skate_mm_per_frame, 0.0);
  EXPECT_EQ(m.foot_slide_max_mm_per_frame, 0.0);
}

TEST(MotionMetrics, PolynomialsHaveTheirExactDerivatives) {
  // Central differences are exact for x = t^2 (acceleration) and t^3 (jerk).
  const MotionMetrics line = MeasureMotion(Along([](double t) { return 0.6 * t; }), 60.0);
  EXPECT_NEAR(line.joint_acceleration_m_s2.max, 0.0, 1e-9);
  const MotionMetrics square = MeasureMotion(Along([](double t) { return 1.5 * t * t; }), 60.0);
  EXPECT_NEAR(square.joint_acceleration_m_s2.mean, 3.0, 1e-7);
  EXPECT_NEAR(square.joint_jerk_m_s3.max, 0.0, 1e-5);
  const MotionMetrics cube = MeasureMotion(Along([](double t) { return t * t * t; }), 60.0);
  EXPECT_NEAR(cube.joint_jerk_m_s3.mean, 6.0, 1e-5);
  EXPECT_NEAR(cube.joint_jerk_m_s3.max, 6.0, 1e-5);
}

TEST(MotionMetrics, SkatingCountsByHeight) {
  // Sliding at 0.6 m/s on the ground is 10 mm per frame at full weight (2 - 2^0 = 1).
  std::vector<JointPositions> frames = Along([](double t) { return 0.6 * t; });
  EXPECT_NEAR(MeasureMotion(frames, 60.0).foot_skate_mm_per_frame, 10.0, 1e-9);
  EXPECT_NEAR(MeasureMotion(frames, 60.0).foot_slide_max_mm_per_frame, 10.0, 1e-9);
  // The right foot high in the air (but for one frame on the ground, its lowest) counts no more.
  for (std::size_t t = 1; t < frames.size(); ++t) frames[t](2, 11) = 0.3;
  const MotionMetrics lifted = MeasureMotion(frames, 60.0);
  EXPECT_NEAR(lifted.foot_skate_mm_per_frame, 10.0 * (59.0 + 1.0) / (2.0 * 59.0), 1e-9);
}

TEST(MotionMetrics, DoesNotDependOnWhereTheClipIs) {
  std::vector<JointPositions> frames = Along([](double t) { return std::sin(5.0 * t); });
  const MotionMetrics here = MeasureMotion(frames, 60.0);
  for (JointPositions& frame : frames) frame.colwise() += Eigen::Vector3d(3.0, -2.0, 0.7);
  const MotionMetrics there = MeasureMotion(frames, 60.0);
  EXPECT_NEAR(here.joint_jerk_m_s3.max, there.joint_jerk_m_s3.max, 1e-6);
  EXPECT_NEAR(here.foot_skate_mm_per_frame, there.foot_skate_mm_per_frame, 1e-9);
}

TEST(MotionMetrics, ShortAndBadInput) {
  EXPECT_THROW(MeasureMotion({}, 60.0), Error);
  const auto one = Along([](double t) { return t; }, 1);
  EXPECT_THROW(MeasureMotion(one, 0.0), Error);
  EXPECT_EQ(MeasureMotion(one, 60.0).joint_acceleration_m_s2.max, 0.0);
  EXPECT_EQ(MeasureMotion(Along([](double t) { return t; }, 4), 60.0).joint_jerk_m_s3.max, 0.0);
}

TEST(JointTrajectory, RestPoseIsTheRestSkeletonMoved) {
  Clip clip;
  clip.pose.assign(2, JointPose::Zero());
  clip.trans.resize(3, 2);
  clip.trans << 0.0, 1.0, 0.0, 2.0, 0.0, 3.0;
  const auto frames = JointTrajectory(clip, DefaultMeasures().rest_joints);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_LT((frames[0] - DefaultMeasures().rest_joints).norm(), 1e-12);
  EXPECT_LT((frames[1] - frames[0]).colwise().sum().array().abs().maxCoeff() - 6.0, 1e-9);
}

}  // namespace
}  // namespace holdfast
