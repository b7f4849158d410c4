// SPDX-License-Identifier: MIT
#include "solver/unknowns/wrist_offset.h"

#include <cmath>

#include <gtest/gtest.h>

#include "geometry/rotation.h"
#include "solver/fit/fitted_hand.h"
#include "solver/terms/hand/hand_prior.h"
#include "solver/terms/hand/paper_terms.h"
#include "solver/unknowns/rotation_manifold.h"
#include "tests/support/hand_scene.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

using testing::HandScene;
using testing::ResidualsAt;

WristOffset SomeOffset() {
  return {Eigen::Quaterniond(ExpSO3(Eigen::Vector3d(0.1, -0.2, 0.15))),
          Eigen::Vector3d(0.02, -0.01, 0.015)};
}

class WristOffsetOf : public ::testing::TestWithParam<Side> {};
INSTANTIATE_TEST_SUITE_P(Sides, WristOffsetOf, ::testing::Values(Side::kRight, Side::kLeft),
                         [](const auto& side) { return std::string(SideName(side.param)); });

TEST_P(WristOffsetOf, MoveHandBringsTheWristWhereTheOffsetSays) {
  const HandScene scene(GetParam());
  HandState before(scene.hand), after(scene.hand);
  before.SetBody(scene.pose, scene.trans);
  before.Evaluate(FingerPose::Zero(), false);
  JointPose pose = scene.pose;
  const WristOffset offset = SomeOffset();
  Eigen::Vector3d trans = scene.trans;
  EXPECT_LT(MoveHand(scene.hand, offset, trans, pose), 1e-9);
  EXPECT_EQ(trans, scene.trans);  // the arm follows, the body stays
  after.SetBody(pose, scene.trans);
  after.Evaluate(FingerPose::Zero(), false);
  EXPECT_LT((after.WristPosition() -
             (before.WristPosition() + before.WristRotation() * offset.translation))
                .norm(),
            1e-9);
  EXPECT_LT(AngleBetween(after.WristRotation(),
                         before.WristRotation() * offset.rotation.toRotationMatrix()),
            1e-7);
  // Only shoulder, elbow and wrist of this side have moved.
  for (int j = 0; j < kNumJoints; ++j) {
    const int wrist = WristJoint(GetParam());
    const bool arm = j == wrist || j == wrist - 2 || j == wrist - 4;
    EXPECT_EQ(pose.col(j) == scene.pose.col(j), !arm) << j;
  }
  // And OffsetTo is its inverse.
  Eigen::Isometry3d target = Eigen::Isometry3d::Identity();
  target.linear() = after.WristRotation();
  target.translation() = after.WristPosition();
  const WristOffset back = OffsetTo(scene.hand, target, scene.trans, scene.pose);
  EXPECT_LT((back.translation - offset.translation).norm(), 1e-9);
  EXPECT_LT(back.rotation.angularDistance(offset.rotation), 1e-7);
}

TEST_P(WristOffsetOf, AWristOutOfReachComesAsNearAsTheArmIsLong) {
  const HandScene scene(GetParam());
  JointPose pose = scene.pose;
  WristOffset offset;
  offset.translation = Eigen::Vector3d(0.0, 3.0, 0.0);
  Eigen::Vector3d trans = scene.trans;
  const double missing = MoveHand(scene.hand, offset, trans, pose);
  EXPECT_GT(missing, 2.0);
  EXPECT_LT(missing, 3.0);
  EXPECT_TRUE(pose.allFinite());
}

TEST_P(WristOffsetOf, OffsetsComposeInTheFrameOfTheMovedHand) {
  const HandScene scene(GetParam());
  const WristOffset a = SomeOffset(), b = SomeOffset().Scaled(-0.4);
  JointPose in_steps = scene.pose, at_once = scene.pose;
  Eigen::Vector3d trans = scene.trans;
  MoveHand(scene.hand, a, trans, in_steps);
  MoveHand(scene.hand, b, trans, in_steps);
  MoveHand(scene.hand, a.Compose(b), trans, at_once);
  HandState s(scene.hand), o(scene.hand);
  s.SetBody(in_steps, scene.trans);
  s.Evaluate(FingerPose::Zero(), false);
  o.SetBody(at_once, scene.trans);
  o.Evaluate(FingerPose::Zero(), false);
  EXPECT_LT((s.WristPosition() - o.WristPosition()).norm(), 1e-9);
  EXPECT_LT(AngleBetween(s.WristRotation(), o.WristRotation()), 1e-7);
}

// A block with D and S of the scene, at a point off it.
struct Setting {
  explicit Setting(Side side) : scene(side), state(scene.hand), block(&state) {
    state.SetBody(scene.pose, scene.trans);
    fingers = FingersOf(scene.pose, side);
    state.Evaluate(fingers, false);
    const Eigen::MatrixXd reference =
        HandObjectDistance::Distances(InObjectFrame(state.Vertices(), scene.object_pose.orientation,
                                                    scene.object_pose.translation),
                                      scene.object);
    distance =
        std::make_unique<HandObjectDistance>(scene.object, reference, 1.3, PairPrecision::kDouble);
    contact = std::make_unique<Contact>(scene.object, reference, 0.02, 5.0);
    block.AddTerm(EnergyTerm::kDistance, distance.get());
    block.AddTerm(EnergyTerm::kContact, contact.get());
    q = scene.object_pose.orientation *
        Eigen::Quaterniond(ExpSO3(Eigen::Vector3d(0.05, 0.1, -0.03)));
    T = scene.object_pose.translation + Eigen::Vector3d(0.01, -0.004, 0.007);
  }
  HandScene scene;
  HandState state;
  HandObjectBlock block;
  std::unique_ptr<HandObjectDistance> distance;
  std::unique_ptr<Contact> contact;
  Eigen::Quaterniond q;
  Eigen::Vector3d T;
  FingerPose fingers;
};

TEST_P(WristOffsetOf, BlockWithoutOffsetIsTheBlockItself) {
  Setting s(GetParam());
  const WristOffsetBlock moved(&s.block, &s.state);
  const WristOffset none;
  const double* plain[] = {s.q.coeffs().data(), s.T.data(), s.fingers.data()};
  const double* with[] = {s.q.coeffs().data(), s.T.data(), s.fingers.data(),
                          none.rotation.coeffs().data(), none.translation.data()};
  const double norm = ResidualsAt(s.block, plain).norm();
  EXPECT_NEAR(norm, ResidualsAt(moved, with).norm(), 1e-9 * norm);
}

TEST_P(WristOffsetOf, MovingHandAndObjectTogetherChangesNothing) {
  Setting s(GetParam());
  const WristOffsetBlock moved(&s.block, &s.state);
  const WristOffset offset = SomeOffset();
  const Eigen::Matrix3d W = s.state.WristRotation();
  const Eigen::Vector3d p = s.state.WristPosition();
  // World motion of the hand: x -> p + W (C W^T (x - p) + c).
  const Eigen::Quaterniond turn(W * offset.rotation.toRotationMatrix() * W.transpose());
  const Eigen::Quaterniond q = turn * s.q;
  const Eigen::Vector3d T = p + turn * (s.T - p) + W * offset.translation;
  const double* plain[] = {s.q.coeffs().data(), s.T.data(), s.fingers.data()};
  const double* with[] = {q.coeffs().data(), T.data(), s.fingers.data(),
                          offset.rotation.coeffs().data(), offset.translation.data()};
  const double norm = ResidualsAt(s.block, plain).norm();
  EXPECT_NEAR(norm, ResidualsAt(moved, with).norm(), 1e-9 * norm);
}

TEST_P(WristOffsetOf, BlockGradientMatchesDifferencesInEveryParameter) {
  Setting s(GetParam());
  const WristOffsetBlock moved(&s.block, &s.state);
  WristOffset offset = SomeOffset();
  const std::vector<double*> parameters = {s.q.coeffs().data(), s.T.data(), s.fingers.data(),
                                           offset.rotation.coeffs().data(),
                                           offset.translation.data()};
  const RotationManifold manifold;
  const testing::Manifolds manifolds = {&manifold, nullptr, nullptr, &manifold};
  const auto [r, J] = testing::RowsAt(moved, parameters.data(), manifolds);
  // The rows have no meaning of their own: cost and gradient do.
  const Eigen::VectorXd gradient = J.transpose() * r,
                        numeric = testing::CostGradientAt(moved, parameters, manifolds, 1e-6);
  Eigen::Index column = 0;
  for (const int size : {3, 3, int{kHandDofs}, 3, 3}) {
    const double norm = gradient.segment(column, size).norm();
    for (const Eigen::Index end = column + size; column < end; ++column) {
      EXPECT_NEAR(gradient(column), numeric(column), 1e-5 * norm + 1e-9) << column;
    }
  }
}

TEST(WristPrior, JacobianMatchesDifferencesAndVanishesAtTheClip) {
  const WristPrior prior(SomeOffset(), 17.0);
  WristOffset step = SomeOffset().Scaled(0.7);
  const RotationManifold manifold;
  EXPECT_LT(testing::JacobianError(prior, {step.rotation.coeffs().data(), step.translation.data()},
                                   {&manifold}),
            1e-6);
  // Taking the whole offset back leaves nothing.
  const WristOffset before = SomeOffset();
  const WristOffset back{before.rotation.conjugate(),
                         -(before.rotation.conjugate() * before.translation)};
  const Eigen::VectorXd r =
      ResidualsAt(prior, {back.rotation.coeffs().data(), back.translation.data()});
  EXPECT_LT(r.norm(), 1e-6);
}

}  // namespace
}  // namespace holdfast
