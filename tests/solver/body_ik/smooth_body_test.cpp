// SPDX-License-Identifier: MIT
#include "solver/body_ik/smooth_body.h"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/matching/body_frame.h"
#include "geometry/rotation.h"
#include "tests/generator/test_body.h"
#include "tests/support/error_text.h"
#include "tests/support/walking_figure.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;

// An estimator's jitter: white noise of 2 degrees in each joint and of 1 cm in the place, and every
// 25th frame a joint that is 40 degrees off.
Clip Jittery(Clip clip, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto noise = [&](double size) {
    return Eigen::Vector3d(size * Eigen::Vector3d(normal(random), normal(random), normal(random)));
  };
  for (int t = 0; t < clip.NumFrames(); ++t) {
    JointPose& pose = clip.pose[static_cast<std::size_t>(t)];
    for (int j = 0; j < kNumBodyJoints; ++j) {
      const double wrong = t % 25 == 12 && j == kLeftElbow ? 40.0 : 0.0;
      pose.col(j) = LogSO3(ExpSO3(pose.col(j)) * ExpSO3(noise(1.15 * kDegree)) *
                           ExpSO3(Eigen::Vector3d(wrong * kDegree, 0, 0)));
    }
    clip.trans.col(t) += noise(0.0058);
  }
  return clip;
}

double MeanJointDistance(const Clip& a, const Clip& b, const Eigen::Matrix3Xd& rest) {
  const std::vector<BodyPlacement> p = Place(rest, BodyFrames(a, rest));
  const std::vector<BodyPlacement> q = Place(rest, BodyFrames(b, rest));
  double sum = 0.0;
  for (std::size_t t = 0; t < p.size(); ++t) {
    sum += (p[t].joints - q[t].joints).colwise().norm().mean();
  }
  return 1e3 * sum / static_cast<double>(p.size());
}

TEST(SmoothBody, TakesJitterAndOutliersFromAWalk) {
  const ClipBody body{BodyModel::Default(), {}};
  // The figure slides a little; the truth is a walk that does not.
  const Clip truth =
      SmoothBody(testing::WalkingFigure(DefaultMeasures(), 200, 1.0), body, {}, "figure").clip;
  const Clip noisy = Jittery(truth, 3);
  const Eigen::Matrix3Xd rest = BodySurface(body.model).RestJoints();
  SmoothOptions options;
  const SmoothedBody smoothed = SmoothBody(noisy, body, options, "walk.npz");
  const double before = MeanJointDistance(noisy, truth, rest);
  const double after = MeanJointDistance(smoothed.clip, truth, rest);
  RecordProperty("before_mm", std::to_string(before));
  RecordProperty("after_mm", std::to_string(after));
  EXPECT_LT(after, 0.75 * before);
  EXPECT_LT(smoothed.report.after.jerk_m_s3, 0.1 * smoothed.report.before.jerk_m_s3);
  EXPECT_TRUE(smoothed.report.feet_pinned);
  EXPECT_LT(smoothed.report.after.skate_mm_s, 0.05 * smoothed.report.before.skate_mm_s);
  EXPECT_GE(smoothed.report.outliers, truth.NumFrames() / 25);
  // The threads do not matter.
  options.threads = 2;
  const Clip again = SmoothBody(noisy, body, options, "walk.npz").clip;
  EXPECT_EQ(again.trans, smoothed.clip.trans);
  EXPECT_EQ(again.pose.back(), smoothed.clip.pose.back());
}

TEST(SmoothBody, RefusesWhatItWouldBreak) {
  const ClipBody body{BodyModel::Default(), {}};
  Clip clip = testing::WalkingFigure(DefaultMeasures(), 20, 1.0);
  const auto fault = [&](double cutoff_hz) {
    SmoothOptions options;
    options.cutoff_hz = cutoff_hz;
    return testing::ErrorText([&] { SmoothBody(clip, body, options, "walk.npz"); });
  };
  EXPECT_THAT(fault(15.0), HasSubstr("less than half of the frame rate"));
  clip.object.emplace();
  EXPECT_THAT(fault(5.0), HasSubstr("has an object"));
  clip.object.reset();
  clip.surface_model_type = "mano";
  EXPECT_THAT(fault(5.0), HasSubstr("hand alone"));
}

}  // namespace
}  // namespace holdfast
