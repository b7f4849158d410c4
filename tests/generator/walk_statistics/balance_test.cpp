// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/balance.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

using Eigen::Vector2d;

class BalanceOfBodies : public ::testing::Test {
 protected:
  BalanceOfBodies() {
    const wandr::Pose<double> pose = wandr::StandingPose(body);
    stands.pelvis = pose.translation + body.rest_joints.col(0);
    for (std::size_t k = 0; k < kNumBodyJoints; ++k) {
      stands.local[k] = Eigen::Quaterniond(pose.rotation[k]);
    }
  }

  // Turned about the ankles, the feet stay.
  BodyFrame Leaning(double forward_rad) const {
    BodyFrame frame = stands;
    const Eigen::AngleAxisd turn(forward_rad, Eigen::Vector3d::UnitX());
    const Eigen::Vector3d ankle = Place(body.rest_joints, stands).joints.col(7);
    frame.pelvis = ankle + turn * (stands.pelvis - ankle);
    frame.local[0] = turn * stands.local[0];
    for (const int joint : {7, 8}) {
      const Eigen::Matrix3d knee = Place(body.rest_joints, frame).rotation[joint - 3];
      const Eigen::Matrix3d foot = Place(body.rest_joints, stands).rotation[joint];
      frame.local[joint] = Eigen::Quaterniond(Eigen::Matrix3d(knee.transpose() * foot));
    }
    return frame;
  }
  std::vector<double> Of(const std::vector<BodyFrame>& frames) const {
    return OffBalance(frames, body.rest_joints, body.sole_y, 30.0);
  }

  BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  BodyFrame stands;
};

TEST_F(BalanceOfBodies, MassesSumToOneAndTheCenterIsInThePelvis) {
  EXPECT_NEAR(std::accumulate(kJointMasses.begin(), kJointMasses.end(), 0.0), 1.0, 1e-9);
  const Eigen::Vector3d center = CenterOfMass(Place(body.rest_joints, stands));
  // 55 to 58 % of an adult's height above the ground.
  EXPECT_NEAR(center.z(), stands.pelvis.z() + 0.05, 0.06);
}

TEST_F(BalanceOfBodies, WhoLeansFartherThanTheToesFalls) {
  EXPECT_EQ(Of({stands})[0], 0.0);
  EXPECT_EQ(Of({Leaning(4.0 * kDegree)})[0], 0.0);
  const double height = CenterOfMass(Place(body.rest_joints, stands)).z();
  const double at_15 = Of({Leaning(15.0 * kDegree)})[0], at_20 = Of({Leaning(20.0 * kDegree)})[0];
  EXPECT_GT(at_15, kOffBalance_m);
  EXPECT_NEAR(at_20 - at_15, height * (std::sin(20.0 * kDegree) - std::sin(15.0 * kDegree)), 0.01);
  EXPECT_GT(Of({Leaning(-15.0 * kDegree)})[0], kOffBalance_m);
}

TEST_F(BalanceOfBodies, CountsOnlyWhereTheBodyStandsStill) {
  std::vector<BodyFrame> walks(30, Leaning(15.0 * kDegree));
  for (std::size_t t = 0; t < walks.size(); ++t) {
    walks[t].pelvis.y() -= 0.02 * static_cast<double>(t < 15 ? t : 15);
  }
  const std::vector<double> off = Of(walks);
  EXPECT_TRUE(std::isnan(off[0]));
  EXPECT_FALSE(std::isnan(off[29]));
  BodyFrame sits = stands;  // thighs level
  for (const int hip : {1, 2}) {
    sits.local[hip] =
        sits.local[hip] * Eigen::AngleAxisd(-90.0 * kDegree, Eigen::Vector3d::UnitX());
    sits.local[hip + 3] =
        sits.local[hip + 3] * Eigen::AngleAxisd(90.0 * kDegree, Eigen::Vector3d::UnitX());
  }
  EXPECT_TRUE(std::isnan(Of({sits})[0]));
}

TEST(FootSupport, IsTheHullOfSolesOnTheGround) {
  Soles soles;
  soles << 0.1, 0.1, -0.1, -0.1,  //
      0.0, -0.2, 0.0, -0.2,       //
      0.0, 0.0, 0.0, 0.0;
  const FootSupport both(soles);
  EXPECT_EQ((both.Nearest({0.05, -0.1}) - Vector2d(0.05, -0.1)).norm(), 0.0);
  EXPECT_LT((both.Nearest({0.3, -0.1}) - Vector2d(0.1, -0.1)).norm(), 1e-12);
  EXPECT_LT((both.Nearest({0.3, 0.3}) - Vector2d(0.1, 0.0)).norm(), 1e-12);
  EXPECT_NEAR(both.Outside({0.3, -0.1}), 0.2 - FootSupport::kFootRadius_m, 1e-12);
  EXPECT_EQ(both.Outside({0.12, -0.1}), 0.0);
  soles(2, 2) = soles(2, 3) = 0.1;  // the right foot is lifted
  const FootSupport left(soles);
  EXPECT_LT((left.Nearest({-0.1, -0.1}) - Vector2d(0.1, -0.1)).norm(), 1e-12);
}

}  // namespace
}  // namespace holdfast
