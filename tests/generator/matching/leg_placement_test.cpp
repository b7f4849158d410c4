// SPDX-License-Identifier: MIT
#include "generator/matching/leg_placement.h"

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

}  // namespace
}  // namespace holdfast
