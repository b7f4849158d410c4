// SPDX-License-Identifier: MIT
#include "generator/body/limb_ik.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "tests/generator/test_body.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

class Draw {
 public:
  Vector3d Direction() {
    return Vector3d(normal_(random_), normal_(random_), normal_(random_)).normalized();
  }
  double Between(double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random_);
  }

 private:
  std::mt19937 random_{11};
  std::normal_distribution<double> normal_;
};

const Limb kLimbs[] = {Arm(Side::kRight), Arm(Side::kLeft), Leg(Side::kRight), Leg(Side::kLeft)};

Vector3d EndOf(const Limb& limb, const Vector3d& root, const LimbPose& pose) {
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  return root + pose.upper * (rest.col(limb.middle) - rest.col(limb.root)) +
         pose.lower * (rest.col(limb.end) - rest.col(limb.middle));
}

TEST(LimbIk, ReachesEveryReachableTarget) {
  Draw draw;
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  for (const Limb& limb : kLimbs) {
    for (int trial = 0; trial < 500; ++trial) {
      const Vector3d root = draw.Direction();
      const double distance =
          draw.Between(MinReach(rest, limb) + 1e-6, MaxReach(rest, limb) - 1e-6);
      const Vector3d target = root + distance * draw.Direction();
      const LimbPose pose = SolveLimb(rest, limb, root, target, draw.Direction());
      EXPECT_TRUE(pose.reached);
      EXPECT_LT((EndOf(limb, root, pose) - target).norm(), 1e-6);
      EXPECT_LT((pose.end - target).norm(), 1e-6);
    }
  }
}

TEST(LimbIk, RotationsAreRotationsAndFlexionStaysInItsRange) {
  Draw draw;
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  for (const Limb& limb : kLimbs) {
    for (int trial = 0; trial < 300; ++trial) {
      const LimbPose pose = SolveLimb(rest, limb, Vector3d::Zero(),
                                      draw.Between(0.0, 2.0) * draw.Direction(), draw.Direction());
      for (const Matrix3d& R : {pose.upper, pose.lower}) {
        EXPECT_LT((R.transpose() * R - Matrix3d::Identity()).norm(), 1e-12);
        EXPECT_NEAR(R.determinant(), 1.0, 1e-12);
      }
      EXPECT_GE(pose.flexion_rad, limb.min_flexion_rad - 1e-6);
      EXPECT_LE(pose.flexion_rad, limb.max_flexion_rad + 1e-6);
    }
  }
}

TEST(LimbIk, MiddleJointBendsAboutItsHingeInTheRightSense) {
  Draw draw;
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  for (const Limb& limb : kLimbs) {
    const Vector3d upper = rest.col(limb.middle) - rest.col(limb.root);
    const Vector3d lower = rest.col(limb.end) - rest.col(limb.middle);
    const double rest_angle = std::atan2(upper.cross(lower).norm(), upper.dot(lower));
    for (int trial = 0; trial < 100; ++trial) {
      const Vector3d target = draw.Between(0.4, 0.9) * MaxReach(rest, limb) * draw.Direction();
      const LimbPose pose = SolveLimb(rest, limb, Vector3d::Zero(), target, draw.Direction());
      const Vector3d bend = LogSO3(pose.upper.transpose() * pose.lower);
      // A pure turn about the hinge but for the small angle the rest pose has itself.
      EXPECT_GT(bend.dot(limb.hinge), 0.0);
      EXPECT_NEAR(bend.dot(limb.hinge), pose.flexion_rad, rest_angle + 0.01);
      EXPECT_LT((bend - bend.dot(limb.hinge) * limb.hinge).norm(), 2.0 * rest_angle + 0.06);
    }
  }
}

TEST(LimbIk, MiddleJointLiesOnTheSideOfThePole) {
  Draw draw;
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  const Limb limb = Arm(Side::kRight);
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d along = draw.Direction();
    const Vector3d pole = draw.Direction();
    const LimbPose pose =
        SolveLimb(rest, limb, Vector3d::Zero(), 0.7 * MaxReach(rest, limb) * along, pole);
    const Vector3d elbow = pose.upper * (rest.col(limb.middle) - rest.col(limb.root));
    const Vector3d outward = elbow - elbow.dot(along) * along;
    const Vector3d asked = pole - pole.dot(along) * along;
    EXPECT_GT(outward.normalized().dot(asked.normalized()), 1.0 - 1e-9);
  }
}

TEST(LimbIk, FarAndNearTargetsAreClampedInTheirDirection) {
  Draw draw;
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  for (const Limb& limb : kLimbs) {
    for (const bool far : {true, false}) {
      const Vector3d along = draw.Direction();
      const double distance = far ? 1.5 * MaxReach(rest, limb) : 0.5 * MinReach(rest, limb);
      const LimbPose pose =
          SolveLimb(rest, limb, Vector3d::Zero(), distance * along, draw.Direction());
      EXPECT_FALSE(pose.reached);
      const double reach = far ? MaxReach(rest, limb) : MinReach(rest, limb);
      EXPECT_LT((pose.end - reach * along).norm(), 1e-6);
    }
  }
}

TEST(LimbIk, DegenerateInputStillGivesAPose) {
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  const Limb limb = Arm(Side::kLeft);
  const LimbPose at_root =
      SolveLimb(rest, limb, Vector3d::Zero(), Vector3d::Zero(), Vector3d::UnitX());
  const LimbPose along_pole =
      SolveLimb(rest, limb, Vector3d::Zero(), 0.3 * Vector3d::UnitX(), Vector3d::UnitX());
  const LimbPose no_pole =
      SolveLimb(rest, limb, Vector3d::Zero(), 0.3 * Vector3d::UnitX(), Vector3d::Zero());
  for (const LimbPose& pose : {at_root, along_pole, no_pole}) {
    EXPECT_TRUE(pose.upper.allFinite());
    EXPECT_TRUE(pose.lower.allFinite());
  }
}

TEST(WristIk, ReachesOrientationsWithinItsRange) {
  Draw draw;
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  const WristLimits limits;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const double sign = side == Side::kRight ? 1.0 : -1.0;
    const Limb arm = Arm(side);
    const Vector3d forearm = (rest.col(arm.end) - rest.col(arm.middle)).normalized();
    for (int trial = 0; trial < 300; ++trial) {
      const Matrix3d lower = ExpSO3(draw.Between(0.0, 3.0) * draw.Direction());
      const double twist = draw.Between(-1.4, 1.4);
      Vector3d swing(0.0, -sign * draw.Between(-0.3, 0.55), sign * draw.Between(-1.1, 1.2));
      swing -= swing.dot(forearm) * forearm;
      const Matrix3d hand = lower * ExpSO3(twist * forearm) * ExpSO3(swing);
      const WristPose pose = SolveWrist(rest, side, lower, hand, limits);
      EXPECT_TRUE(pose.reached);
      EXPECT_LT(AngleBetween(pose.lower * pose.wrist, hand), 1e-6);
      EXPECT_NEAR(pose.twist_rad, twist, 1e-6);
      // The twist of the forearm leaves the wrist where it was.
      EXPECT_LT((pose.lower * forearm - lower * forearm).norm(), 1e-12);
    }
  }
}

TEST(WristIk, KeepsItsLimitsWhateverIsAsked) {
  Draw draw;
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  const WristLimits limits;
  for (int trial = 0; trial < 500; ++trial) {
    const Matrix3d hand = ExpSO3(draw.Between(0.0, 3.1) * draw.Direction());
    const WristPose pose = SolveWrist(rest, Side::kRight, Matrix3d::Identity(), hand, limits);
    EXPECT_LE(std::abs(pose.twist_rad), limits.twist_max);
    EXPECT_LE(pose.flexion_rad, limits.flexion_max);
    EXPECT_GE(pose.flexion_rad, limits.flexion_min);
    EXPECT_LE(pose.ulnar_rad, limits.ulnar_max);
    EXPECT_GE(pose.ulnar_rad, limits.ulnar_min);
    EXPECT_EQ(pose.reached, AngleBetween(pose.lower * pose.wrist, hand) < 1e-6);
  }
}

TEST(HandOrientation, PutsFingersThumbAndPalmWhereTheyBelong) {
  Draw draw;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    // Rest: right fingers along -x, left along +x, palms down, thumbs forward (+z).
    const double x = side == Side::kRight ? -1.0 : 1.0;
    EXPECT_LT((HandOrientation(side, {x, 0, 0}, Vector3d::UnitZ()) - Matrix3d::Identity()).norm(),
              1e-12);
    for (int trial = 0; trial < 100; ++trial) {
      const Vector3d fingers = draw.Direction();
      const Vector3d thumb = draw.Direction();
      const Matrix3d hand = HandOrientation(side, fingers, thumb);
      EXPECT_NEAR(hand.determinant(), 1.0, 1e-12);
      EXPECT_LT((FingerDirection(side, hand) - fingers).norm(), 1e-12);
      EXPECT_GT(hand.col(2).dot(thumb), 0.0);
      EXPECT_NEAR(PalmDirection(hand).dot(thumb), 0.0, 1e-12);
    }
  }
  EXPECT_THROW(HandOrientation(Side::kRight, Vector3d::UnitX(), Vector3d::UnitX()), Error);
}

}  // namespace
}  // namespace holdfast
