// SPDX-License-Identifier: MIT
#include "geometry/score/rigid_jitter.h"

#include <random>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

Eigen::Isometry3d PoseOf(const Eigen::Vector3d& turn, const Eigen::Vector3d& at) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = ExpSO3(turn);
  pose.translation() = at;
  return pose;
}

std::vector<Eigen::Isometry3d> WavingWrist(int frames) {
  std::vector<Eigen::Isometry3d> poses;
  for (int t = 0; t < frames; ++t) {
    const double s = t / 30.0;
    poses.push_back(PoseOf({std::sin(3 * s), 0.4 * s, std::cos(5 * s)},
                           {0.3 * std::sin(4 * s), 0.2 * s * s, std::cos(s)}));
  }
  return poses;
}

TEST(RigidJitter, PolynomialsHaveTheirExactDerivatives) {
  std::vector<Eigen::Isometry3d> poses;
  for (int t = 0; t < 20; ++t) {
    const double s = t / 30.0;
    poses.push_back(PoseOf({0, 0, 2.0 * s * s}, {s * s * s, 0, 0}));
  }
  const Unevenness u = MeasureUnevenness(poses, Eigen::Vector3d::Zero(), 30.0);
  EXPECT_NEAR(*u.jerk_m_s3, 6.0, 1e-6);
  EXPECT_NEAR(*u.angular_acceleration_rad_s2, 4.0, 1e-9);
  EXPECT_NEAR(*u.angular_jerk_rad_s3, 0.0, 1e-6);
  const Unevenness short_clip =
      MeasureUnevenness(std::span(poses).first(2), Eigen::Vector3d::Zero(), 30.0);
  EXPECT_FALSE(short_clip.acceleration_m_s2.has_value());
}

TEST(RigidJitter, ARigidCarryIsExactlyOneHoweverFarFromTheWrist) {
  const auto wrist = WavingWrist(60);
  for (const double far : {0.0, 0.1, 2.0}) {
    const Eigen::Isometry3d grasp = PoseOf({0.3, 1.0, -0.5}, {far, 0.05, 0.0});
    std::vector<Eigen::Isometry3d> object;
    for (const auto& pose : wrist) object.push_back(pose * grasp);
    const CarryJitter jitter = MeasureCarryJitter(wrist, object, {0.01, 0.02, 0.2}, 30.0);
    EXPECT_NEAR(*jitter.acceleration_ratio, 1.0, 1e-9);
    EXPECT_NEAR(*jitter.jerk_ratio, 1.0, 1e-8);
    EXPECT_NEAR(*jitter.angular_acceleration_ratio, 1.0, 1e-9);
    EXPECT_NEAR(*jitter.angular_jerk_ratio, 1.0, 1e-8);
    if (far > 1.0) {
      EXPECT_GT(*jitter.object.acceleration_m_s2, 2.0 * *jitter.wrist.acceleration_m_s2);
    }
  }
}

TEST(RigidJitter, NoiseOnTheObjectShows) {
  const auto wrist = WavingWrist(60);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.002);
  std::vector<Eigen::Isometry3d> object = wrist;
  for (auto& pose : object) {
    pose.translation() += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
  const CarryJitter jitter = MeasureCarryJitter(wrist, object, Eigen::Vector3d::Zero(), 30.0);
  EXPECT_GT(*jitter.acceleration_ratio, 1.2);
  EXPECT_GT(*jitter.jerk_ratio, *jitter.acceleration_ratio);
  EXPECT_NEAR(*jitter.angular_acceleration_ratio, 1.0, 1e-9);
}

TEST(RigidJitter, AStillHandHasNoRatio) {
  const std::vector<Eigen::Isometry3d> still(10, PoseOf({0.1, 0.2, 0.3}, {1, 2, 3}));
  const CarryJitter jitter = MeasureCarryJitter(still, still, {0.1, 0, 0}, 30.0);
  EXPECT_FALSE(jitter.acceleration_ratio.has_value());
  EXPECT_FALSE(jitter.angular_jerk_ratio.has_value());
  EXPECT_NEAR(*jitter.object.acceleration_m_s2, 0.0, 1e-9);
}

TEST(RigidJitter, FramesThatDoNotCountAreLeftOut) {
  auto object = WavingWrist(30);
  const auto wrist = object;
  object[25].translation().x() += 1.0;
  std::vector<std::uint8_t> counts(30, 1);
  counts[25] = 0;
  EXPECT_NEAR(*MeasureCarryJitter(wrist, object, {0, 0, 0}, 30.0, counts).acceleration_ratio, 1.0,
              1e-9);
  EXPECT_GT(*MeasureCarryJitter(wrist, object, {0, 0, 0}, 30.0).acceleration_ratio, 2.0);
  EXPECT_THROW(MeasureCarryJitter(wrist, std::span(object).first(3), {0, 0, 0}, 30.0), Error);
  EXPECT_THROW(MeasureCarryJitter(wrist, object, {0, 0, 0}, 0.0), Error);
  counts.pop_back();
  EXPECT_THROW(MeasureCarryJitter(wrist, object, {0, 0, 0}, 30.0, counts), Error);
}

}  // namespace
}  // namespace holdfast
