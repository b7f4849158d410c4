// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/reach_faults.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Who stands upright facing -y for 120 frames.
class FaultsOfReaches : public ::testing::Test {
 protected:
  FaultsOfReaches() {
    const wandr::Pose<double> pose = wandr::StandingPose(body);
    BodyFrame frame;
    frame.pelvis = pose.translation + body.rest_joints.col(0);
    for (std::size_t k = 0; k < kNumBodyJoints; ++k) {
      frame.local[k] = Eigen::Quaterniond(pose.rotation[k]);
    }
    frames.assign(120, frame);
  }
  ReachFaults Found() const { return FindReachFaults(frames, body); }
  // Sinks as a cosine does: `depth` at the middle of [begin, end).
  void Sink(int begin, int end, double depth) {
    for (int t = begin; t < end; ++t) {
      const double phase = 2.0 * std::numbers::pi * (t - begin) / (end - begin);
      frames[static_cast<std::size_t>(t)].pelvis.z() -= 0.5 * depth * (1.0 - std::cos(phase));
    }
  }
  void Lean(double back_degrees, int begin, int end) {
    for (int t = begin; t < end; ++t) {
      Eigen::Quaterniond& root = frames[static_cast<std::size_t>(t)].local[0];
      root = Eigen::AngleAxisd(-back_degrees * kDegree, Eigen::Vector3d::UnitX()) * root;
    }
  }

  BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  std::vector<BodyFrame> frames;
};

TEST_F(FaultsOfReaches, WhoStandsHasNone) {
  EXPECT_FALSE(Found().second_crouch >= 0);
  EXPECT_FALSE(Found().lean_back_rad > 10.0 * kDegree);
  EXPECT_LT(std::abs(Found().lean_back_rad), 8.0 * kDegree);
}

TEST_F(FaultsOfReaches, OneCrouchIsNone) {
  Sink(20, 100, 0.4);
  EXPECT_FALSE(Found().second_crouch >= 0);
}

TEST_F(FaultsOfReaches, TwoCrouchesWithStandingBetweenThemAreTwoReaches) {
  Sink(0, 60, 0.4);
  Sink(60, 120, 0.4);
  EXPECT_FALSE(Found().second_crouch >= 0);
}

TEST_F(FaultsOfReaches, HalfWayUpAndDownAgainIsTheFault) {
  Sink(0, 120, 0.3);
  for (int t = 40; t < 80; ++t) {
    frames[static_cast<std::size_t>(t)].pelvis.z() +=
        0.15 * std::sin(std::numbers::pi * (t - 40) / 40.0);
  }
  const ReachFaults faults = Found();
  EXPECT_TRUE(faults.second_crouch >= 0);
  EXPECT_GT(faults.second_crouch, 60);
  EXPECT_LT(faults.second_crouch, 90);
}

TEST_F(FaultsOfReaches, AWalksBobDoesNotCount) {
  for (std::size_t t = 0; t < frames.size(); ++t) {
    frames[t].pelvis.z() -= 0.15 - 0.025 * std::cos(0.8 * static_cast<double>(t));
    frames[t].pelvis.y() -= 0.04 * static_cast<double>(t);
  }
  EXPECT_FALSE(Found().second_crouch >= 0);
}

TEST_F(FaultsOfReaches, LeaningBackCountsWhereItIsKeptUpAndWaitedFor) {
  const std::vector<BodyFrame> upright = frames;
  const double before = Found().lean_back_rad;
  Lean(20.0, 30, 80);
  EXPECT_TRUE(Found().lean_back_rad > 10.0 * kDegree);
  EXPECT_NEAR(Found().lean_back_rad - before, 20.0 * kDegree, 1e-6);
  frames = upright;
  Lean(20.0, 30, 36);
  EXPECT_FALSE(Found().lean_back_rad > 10.0 * kDegree);
  frames = upright;
  Lean(-40.0, 30, 80);
  EXPECT_FALSE(Found().lean_back_rad > 10.0 * kDegree);
  frames = upright;
  Lean(20.0, 30, 80);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    frames[t].pelvis.y() -= 0.03 * static_cast<double>(t);
  }
  EXPECT_TRUE(std::isnan(Found().lean_back_rad));
  EXPECT_FALSE(Found().lean_back_rad > 10.0 * kDegree);
}

}  // namespace
}  // namespace holdfast
