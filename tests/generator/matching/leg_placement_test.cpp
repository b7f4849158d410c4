// SPDX-License-Identifier: MIT
#include "generator/matching/foot_lock.h"

#include <gtest/gtest.h>

#include "geometry/rotation.h"
#include "tests/generator/test_body.h"

namespace holdfast {
namespace {

// Networks may bend a knee backwards, far enough that its place points to the back of the leg.
TEST(PlaceLegs, KneesBentBackwardsBendForwards) {
  const Eigen::Matrix3Xd& rest_joints = DefaultMeasures().rest_joints;
  for (const double back : {5.0, 15.0, 25.0, 40.0}) {
    BodyFrame frame;
    const Eigen::AngleAxisd turn(-back * kDegree, Eigen::Vector3d::UnitX());
    frame.local[kRightKnee] = Eigen::Quaterniond(turn);
    const FeetTarget feet = FeetOf(Place(rest_joints, frame));
    EXPECT_LT(PlaceLegs(rest_joints, feet, frame), 1e-3) << back;
    const BodyPlacement placed = Place(rest_joints, frame);
    EXPECT_GT(placed.rotation[kRightHip](2, 2), 0.5) << "the thigh's front stays in front";
    EXPECT_GT(LogSO3(frame.local[kRightKnee].toRotationMatrix()).x(), 0.0) << back;
    EXPECT_TRUE(placed.rotation[kRightAnkle].isApprox(feet.rotation[1], 1e-9)) << back;
  }
}

// A leg too short for its place does not lift the foot far off the ground: it comes nearer.
TEST(DrawIntoReach, FeetStayNearTheGround) {
  const Eigen::Matrix3Xd& rest_joints = DefaultMeasures().rest_joints;
  const BodyFrame frame;
  const FeetTarget stand = FeetOf(Place(rest_joints, frame));
  for (const double away : {0.1, 0.3, 0.5, 0.9}) {
    SCOPED_TRACE(away);
    FeetTarget feet = stand;
    feet.ankle[1].y() -= away;
    const Eigen::Vector3d wanted = feet.ankle[1];
    const double drawn = DrawIntoReach(rest_joints, frame, feet);
    EXPECT_NEAR((feet.ankle[1] - wanted).norm(), drawn, 1e-9);
    EXPECT_TRUE(feet.ankle[0].isApprox(stand.ankle[0], 0.01)) << "the other leg is long enough";
    EXPECT_GE(feet.ankle[1].z(), wanted.z() - 1e-9);
    EXPECT_LE(feet.ankle[1].z(), wanted.z() + 0.04 + 1e-9);
    EXPECT_NEAR(feet.ankle[1].x(), wanted.x(), 0.05) << "towards the hip";
    BodyFrame placed = frame;
    EXPECT_LT(PlaceLegs(rest_joints, feet, placed), 1e-3) << "the leg reaches it";
  }
}

// What is in reach is left alone.
TEST(DrawIntoReach, MovesNothingThatIsInReach) {
  const Eigen::Matrix3Xd& rest_joints = DefaultMeasures().rest_joints;
  const BodyFrame frame;
  FeetTarget feet = FeetOf(Place(rest_joints, frame));
  for (Eigen::Vector3d& ankle : feet.ankle) ankle.z() += 0.05;
  const FeetTarget before = feet;
  EXPECT_EQ(DrawIntoReach(rest_joints, frame, feet), 0.0);
  EXPECT_EQ(feet.ankle, before.ankle);
}

}  // namespace
}  // namespace holdfast
