// SPDX-License-Identifier: MIT
#include "solver/terms/hand/hand_prior.h"
#include "geometry/rotation.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "solver/hand/hand_landmarks.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

struct Hands {
  Hands()
      : right(BodyModel::Default(), {}, Side::kRight),
        left(BodyModel::Default(), {}, Side::kLeft),
        right_axes(right),
        left_axes(left) {}
  HandModel right, left;
  HandAxes right_axes, left_axes;
};

HandAngles RandomAngles(unsigned seed, double scale) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(-scale, scale);
  HandAngles angles;
  for (double& angle : angles.reshaped()) angle = uniform(engine);
  return angles;
}

TEST(HandAxes, FingersCurlAboutZ) {
  const Hands hands;
  EXPECT_GT(hands.right_axes.Forward().dot(-Eigen::Vector3d::UnitX()), 0.98);
  EXPECT_GT(hands.left_axes.Forward().dot(Eigen::Vector3d::UnitX()), 0.98);
  for (const HandAxes* axes : {&hands.right_axes, &hands.left_axes}) {
    EXPECT_GT(axes->PalmNormal().dot(-Eigen::Vector3d::UnitY()), 0.97);  // palms down at rest
    const double z = axes->HandSide() == Side::kRight ? 1.0 : -1.0;
    for (int k = 0; k < kJointsPerHand; ++k) {
      const Eigen::Matrix3d& basis = axes->Axes(k);
      EXPECT_LT((basis.transpose() * basis - Eigen::Matrix3d::Identity()).norm(), 1e-12);
      if (k / 3 == kThumb) continue;
      EXPECT_GT(z * basis(2, 0), 0.9) << kJointNames[HandBegin(axes->HandSide()) + k];
    }
  }
}

TEST(HandAxes, FlexionBringsTipsTowardsThePalmAndSpreadTowardsTheThumb) {
  const Hands hands;
  for (const HandModel* hand : {&hands.right, &hands.left}) {
    const HandAxes axes(*hand);
    const HandLandmarks landmarks(*hand, axes);
    HandState state(*hand);
    state.SetBody(JointPose::Zero(), Eigen::Vector3d::Zero());
    const auto tip = [&](const HandAngles& angles, int finger) -> Eigen::Vector3d {
      state.Evaluate(axes.PoseOf(angles), false);
      return state.Vertices().col(landmarks.PadCenter(finger));
    };
    for (int finger = 0; finger < kNumFingers; ++finger) {
      HandAngles flexed = HandAngles::Zero(), spread = HandAngles::Zero();
      flexed(0, 3 * finger) = 0.2;
      spread(1, 3 * finger) = 0.2;
      const Eigen::Vector3d rest = tip(HandAngles::Zero(), finger);
      const Eigen::Vector3d by_flexion = tip(flexed, finger) - rest;
      const Eigen::Vector3d by_spread = tip(spread, finger) - rest;
      EXPECT_GT(by_flexion.normalized().dot(axes.PadDirection(3 * finger)), 0.5);
      EXPECT_GT(by_spread.normalized().dot(finger == kThumb ? axes.PalmNormal() : axes.Across()),
                0.5);
      // Flexion closes the hand: the thumb crosses the palm, away from its own side.
      if (finger == kThumb) {
        EXPECT_LT(by_flexion.dot(axes.Across()), 0.0);
      }
    }
  }
}

TEST(HandAxes, LeftIsTheMirrorOfRight) {
  const Hands hands;
  const HandAngles angles = RandomAngles(3, 0.8);
  JointPose right = JointPose::Zero();
  SetFingers(right, Side::kRight, hands.right_axes.PoseOf(angles));
  const FingerPose mirrored = FingersOf(MirrorPose(right), Side::kLeft);
  EXPECT_LT((mirrored - hands.left_axes.PoseOf(angles)).cwiseAbs().maxCoeff(), 2e-3);
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < kJointsPerHand; ++k) {
      EXPECT_NEAR(hands.right_axes.Range(row, k).low, hands.left_axes.Range(row, k).low, 5e-3);
      EXPECT_NEAR(hands.right_axes.Range(row, k).high, hands.left_axes.Range(row, k).high, 5e-3);
    }
  }
}

TEST(HandAxes, AnglesAndPosesAreTheSameNumbersTurned) {
  const Hands hands;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const HandAngles angles = RandomAngles(seed, 2.0);
    const FingerPose pose = hands.right_axes.PoseOf(angles);
    EXPECT_LT((hands.right_axes.AnglesOf(pose) - angles).norm(), 1e-13);
    EXPECT_NEAR(pose.norm(), angles.norm(), 1e-12);
  }
}

TEST(HandAxes, ClampIsIdempotentAndRestAndRelaxedAreWithinReach) {
  const Hands hands;
  const HandAngles clamped = hands.right_axes.Clamp(RandomAngles(5, 4.0));
  EXPECT_EQ(hands.right_axes.Clamp(clamped), clamped);
  EXPECT_EQ(hands.right_axes.LimitExcess(clamped), 0.0);
  EXPECT_EQ(hands.right_axes.LimitExcess(HandAngles::Zero()), 0.0);
  EXPECT_EQ(hands.right_axes.LimitExcess(hands.right_axes.Relaxed()), 0.0);
  HandAngles beyond = HandAngles::Zero();
  beyond(0, 3 * kIndex + 1) = 130.0 * kDegree;
  EXPECT_NEAR(hands.right_axes.LimitExcess(beyond) / kDegree,
              25.0 + hands.right_axes.RestFlexion(3 * kIndex + 1) / kDegree, 1e-9);
}

Eigen::VectorXd Evaluate(const HandPriorTerm& term, const FingerPose& pose) {
  return testing::ResidualsAt(term, {pose.data()});
}

TEST(HandPrior, JacobianMatchesDifferences) {
  const Hands hands;
  for (const HandAxes* axes : {&hands.right_axes, &hands.left_axes}) {
    HandPriorWeights weights;
    weights.spread = 0.7;
    const HandPriorTerm term(*axes, axes->Relaxed(), weights);
    for (unsigned seed = 0; seed < 5; ++seed) {
      FingerPose pose = axes->PoseOf(RandomAngles(seed, 2.0));
      EXPECT_LT(testing::JacobianError(term, {pose.data()}), 1e-7);
    }
  }
}

TEST(HandPrior, IsNothingAtThePreferredPoseWithinLimits) {
  const Hands hands;
  HandPriorWeights weights;
  weights.coupling = 0.0;
  const HandAngles relaxed = hands.right_axes.Relaxed();
  const HandPriorTerm term(hands.right_axes, relaxed, weights);
  EXPECT_LT(Evaluate(term, hands.right_axes.PoseOf(relaxed)).norm(), 1e-13);
}

TEST(HandPrior, LimitsCountTheExcessOnly) {
  const Hands hands;
  HandPriorWeights only_limits{.limits = 10.0, .coupling = 0.0, .neighbors = 0.0, .stay = 0.0};
  const HandPriorTerm term(hands.right_axes, HandAngles::Zero(), only_limits);
  HandAngles angles = HandAngles::Zero();
  const AngleRange& range = hands.right_axes.Range(0, 3 * kMiddle);
  angles(0, 3 * kMiddle) = range.high - 0.01;
  EXPECT_EQ(Evaluate(term, hands.right_axes.PoseOf(angles)).norm(), 0.0);
  angles(0, 3 * kMiddle) = range.high + 0.2;
  EXPECT_NEAR(Evaluate(term, hands.right_axes.PoseOf(angles)).norm(), 2.0, 1e-9);
}

TEST(HandPrior, LastJointFollowsTheMiddleOne) {
  const Hands hands;
  HandPriorWeights only_coupling{.limits = 0.0, .coupling = 1.0, .neighbors = 0.0, .stay = 0.0};
  const HandPriorTerm term(hands.right_axes, HandAngles::Zero(), only_coupling);
  HandAngles angles;
  for (int k = 0; k < kJointsPerHand; ++k) {
    const double flexion = k % 3 == 1 ? 0.9 : k % 3 == 2 ? 0.6 : 0.3;
    angles.col(k) << flexion - hands.right_axes.RestFlexion(k), 0.0, 0.0;
  }
  EXPECT_LT(Evaluate(term, hands.right_axes.PoseOf(angles)).norm(), 1e-13);
  angles(0, 3 * kRing + 2) += 0.3;
  EXPECT_NEAR(Evaluate(term, hands.right_axes.PoseOf(angles)).norm(), 0.3, 1e-12);
}

TEST(AngleRangeTerm, IsTheExcessOfOneJoint) {
  const Hands hands;
  const int joint = 3 * kMiddle;
  const AngleRangeTerm term(hands.right_axes, joint, 4.0);
  Eigen::Vector3d angles(hands.right_axes.Range(0, joint).high + 0.2, 0.0,
                         hands.right_axes.Range(2, joint).low - 0.1);
  EXPECT_LT((testing::ResidualsAt(term, {angles.data()}) - Eigen::Vector3d(0.4, 0.0, -0.2)).norm(),
            1e-12);
  EXPECT_LT(testing::JacobianError(term, {angles.data()}), 1e-6);
}

}  // namespace
}  // namespace holdfast
