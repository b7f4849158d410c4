// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/set_spread.h"

#include <cmath>

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"

namespace holdfast {
namespace {

class SpreadSet : public ::testing::Test {
 protected:
  // Walks along -y by so much a frame, from another place and by another heading.
  std::vector<BodyFrame> Motion(int frames, double step_m, double yaw, double from) const {
    PlanarMove move;
    move.yaw_rad = yaw;
    move.shift = {from, -2.0 * from};
    std::vector<BodyFrame> motion(static_cast<std::size_t>(frames));
    for (int t = 0; t < frames; ++t) {
      BodyFrame frame;
      frame.local[0] = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI_2, Eigen::Vector3d::UnitX()));
      frame.pelvis = {0.0, -step_m * t, 1.0};
      motion[static_cast<std::size_t>(t)] = move * frame;
    }
    return motion;
  }
  BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
};

TEST_F(SpreadSet, PlaceAndHeadingOfTheFirstFrameDoNotCount) {
  const std::vector<std::vector<BodyFrame>> set = {Motion(20, 0.03, 0.0, 0.0),
                                                   Motion(20, 0.03, 1.2, 3.0)};
  EXPECT_NEAR(SetSpread(set, body.rest_joints), 0.0, 1e-9);
}

TEST_F(SpreadSet, IsTheMeanDistanceOverTimeAndPairs) {
  std::vector<std::vector<BodyFrame>> set = {Motion(11, 0.03, 0.0, 0.0),
                                             Motion(11, 0.05, 0.7, 1.0)};
  EXPECT_NEAR(SetSpread(set, body.rest_joints), 0.02 * 5.0, 1e-9);
  set.push_back(set[0]);
  EXPECT_NEAR(SetSpread(set, body.rest_joints), 0.02 * 5.0 * 2.0 / 3.0, 1e-9);
}

TEST_F(SpreadSet, WhoEndsFirstStaysWhereItIs) {
  const std::vector<std::vector<BodyFrame>> set = {Motion(1, 0.0, 0.0, 0.0),
                                                   Motion(11, 0.04, 0.0, 0.0)};
  EXPECT_NEAR(SetSpread(set, body.rest_joints), 0.04 * 5.0, 1e-9);
}

TEST_F(SpreadSet, OneMotionHasNone) {
  const std::vector<std::vector<BodyFrame>> set = {Motion(11, 0.04, 0.0, 0.0)};
  EXPECT_TRUE(std::isnan(SetSpread(set, body.rest_joints)));
}

}  // namespace
}  // namespace holdfast
