// SPDX-License-Identifier: MIT
#include "solver/body_ik/foot_lift.h"

#include <gtest/gtest.h>

#include "generator/wandr/motion_states.h"
#include "solver/body_ik/frame_pose.h"

namespace holdfast {
namespace {

class PinnedFeet : public ::testing::Test {
 protected:
  PinnedFeet() : pinner(body.rest_joints, body.sole_y) {}

  Soles SolesOf(const BodyFrame& frame) const {
    return SolePoints(body.rest_joints, body.sole_y).At(Place(body.rest_joints, frame));
  }

  BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  BodyFrame standing = FrameOf(wandr::StandingPose(body), body.rest_joints.col(0));
  FootPinner pinner;
};

TEST_F(PinnedFeet, WhoStandsIsLeftAlone) {
  for (int t = 0; t < 20; ++t) {
    BodyFrame frame = standing;
    pinner.Pin(frame);
    EXPECT_LT((SolesOf(frame) - SolesOf(standing)).cwiseAbs().maxCoeff(), 0.01) << t;
  }
  EXPECT_EQ(pinner.Drag().norm(), 0.0);
}

TEST_F(PinnedFeet, FeetOfABodyThatSlidesStayAndItIsToldToGiveWay) {
  BodyFrame slides = standing;
  pinner.Pin(slides);
  const Soles before = SolesOf(slides);
  for (int t = 1; t <= 12; ++t) {
    slides = standing;
    slides.pelvis.x() += 0.004 * t;  // 12 cm/s
    pinner.Pin(slides);
  }
  EXPECT_LT((SolesOf(slides) - before).topRows<2>().cwiseAbs().maxCoeff(), 0.003);
  EXPECT_NEAR(pinner.Drag().x(), -(0.048 - 0.03), 1e-6);
  pinner.Follow(pinner.Drag());
  EXPECT_LT(pinner.Drag().norm(), 1e-9);
}

TEST_F(PinnedFeet, AFootThatIsDraggedFarMakesAStepWhileTheOtherStands) {
  BodyFrame slides = standing;
  int both = 0;
  double highest = 0.0;
  Eigen::Vector2d farthest = Eigen::Vector2d::Zero();
  for (int t = 0; t <= 60; ++t) {
    slides = standing;
    slides.pelvis.x() += 0.004 * t;
    pinner.Pin(slides);
    const Soles soles = SolesOf(slides);
    const double left = soles.leftCols<2>().row(2).minCoeff();
    const double right = soles.rightCols<2>().row(2).minCoeff();
    highest = std::max({highest, left, right});
    both += left > 0.01 && right > 0.01;
    farthest = (soles - SolesOf(standing)).topRows<2>().rowwise().mean();
    EXPECT_GT(std::min(left, right), -0.005) << t;
  }
  EXPECT_GT(highest, 0.02);
  EXPECT_EQ(both, 0);
  EXPECT_GT(farthest.x(), 0.12);
}

TEST_F(PinnedFeet, SolesComeOutOfTheGround) {
  BodyFrame frame;
  for (int t = 0; t < 30; ++t) {
    frame = standing;
    frame.pelvis.z() -= 0.05;
    pinner.Pin(frame);
  }
  EXPECT_GT(SolesOf(frame).row(2).minCoeff(), -0.005);
}

TEST_F(PinnedFeet, ToesDoNotPointIntoTheGround) {
  BodyFrame frame = standing;
  frame.local[kLeftFoot] = Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()));
  ASSERT_LT(Place(body.rest_joints, frame).rotation[kLeftFoot](2, 2), -0.4);
  pinner.Pin(frame);
  EXPECT_GT(Place(body.rest_joints, frame).rotation[kLeftFoot](2, 2), -0.05);
}

TEST_F(PinnedFeet, AFootThatStandsKeepsTheWayItPoints) {
  BodyFrame turns = standing;
  pinner.Pin(turns);
  const Soles before = SolesOf(turns);
  for (int t = 1; t <= 15; ++t) {
    turns = standing;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.01 * t, Eigen::Vector3d::UnitZ()));
    turns.local[kPelvis] = turn * turns.local[kPelvis];
    pinner.Pin(turns);
  }
  EXPECT_LT((SolesOf(turns) - before).topRows<2>().cwiseAbs().maxCoeff(), 0.01);
}

}  // namespace
}  // namespace holdfast
