// SPDX-License-Identifier: MIT
#include "geometry/body/hand_model.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "tests/support/synthetic_body.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

// The dense synthetic model (every finger moves every vertex, as in SMPL-X) and the default one
// (local blend shapes: several groups).
std::vector<std::shared_ptr<const BodyModel>> Models() {
  const testing::TemporaryFolder folder;
  testing::SyntheticBody(80).Write(folder / "model.npz");
  return {BodyModel::Load(folder / "model.npz"), BodyModel::Default()};
}

JointPose RandomBodyPose(unsigned seed) {
  std::srand(seed);
  return 0.5 * JointPose::Random();
}

TEST(HandModel, IsTheBodyModelSeenFromTheHand) {
  for (const auto& model : Models()) {
    const Eigen::VectorXd betas = Eigen::VectorXd::Constant(5, 0.7);
    const BodySurface body(model, betas);
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const HandModel hand(model, betas, side);
      HandState state(hand);
      BodyState expected;
      for (unsigned seed = 1; seed < 4; ++seed) {
        const JointPose pose = RandomBodyPose(seed);
        Forward(body, pose, {0.1, -0.4, 1.0}, expected);
        state.SetBody(RandomBodyPose(seed), {0.1, -0.4, 1.0});
        state.Evaluate(FingersOf(pose, side), false);
        for (int i = 0; i < hand.NumVertices(); ++i) {
          EXPECT_LT((state.Vertices().col(i) - expected.vertices.col(hand.Surface().VertexIds()[i]))
                        .norm(),
                    1e-13);
        }
        EXPECT_LT((state.WristPosition() - expected.joints.col(WristJoint(side))).norm(), 1e-13);
      }
    }
  }
}

// What has not moved is not computed again: to the bit the same as from nothing.
TEST(HandModel, IsTheSameWhicheverFingersMovedLast) {
  for (const auto& model : Models()) {
    const HandModel hand(model, {}, Side::kRight);
    HandState state(hand);
    const JointPose pose = RandomBodyPose(3);
    state.SetBody(pose, {0.1, -0.4, 1.0});
    FingerPose fingers = FingerPose::Zero();
    for (const int joint : {-1, 14, 0, 4, 4, 12, -1}) {
      if (joint >= 0) fingers.segment<3>(3 * joint) += Eigen::Vector3d(0.3, -0.2, 0.1);
      state.Evaluate(fingers, joint == 4);
      HandState anew(hand);
      anew.SetBody(pose, {0.1, -0.4, 1.0});
      anew.Evaluate(fingers, true);
      EXPECT_EQ(state.Vertices(), anew.Vertices());
      EXPECT_EQ(state.JointPositions(), anew.JointPositions());
      if (joint != 4) state.EvaluateJacobians();
      for (std::size_t g = 0; g < hand.Groups().size(); ++g) {
        EXPECT_EQ(state.GroupJacobian(static_cast<int>(g)),
                  anew.GroupJacobian(static_cast<int>(g)));
      }
    }
    state.SetBody(RandomBodyPose(4), {0.1, -0.4, 1.0});
    state.Evaluate(fingers, false);
    HandState anew(hand);
    anew.SetBody(RandomBodyPose(4), {0.1, -0.4, 1.0});
    anew.Evaluate(fingers, false);
    EXPECT_EQ(state.Vertices(), anew.Vertices());
  }
}

TEST(HandModel, GroupsHoldEveryVertexOnce) {
  for (const auto& model : Models()) {
    const HandModel hand(model, {}, Side::kRight);
    std::vector<int> seen(static_cast<std::size_t>(hand.NumVertices()), 0);
    for (const HandModel::Group& group : hand.Groups()) {
      for (const int i : group.vertices) ++seen[static_cast<std::size_t>(i)];
    }
    EXPECT_EQ(std::accumulate(seen.begin(), seen.end(), 0), hand.NumVertices());
    EXPECT_EQ(*std::max_element(seen.begin(), seen.end()), 1);
  }
}

TEST(HandModel, GroupJacobiansAreTheBodyModelsOwn) {
  for (const auto& model : Models()) {
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const HandModel hand(model, {}, side);
      const JointPose pose = RandomBodyPose(9);
      HandState state(hand);
      state.SetBody(pose, {0, 0, 1});
      state.Evaluate(FingersOf(pose, side), true);
      BodyState body;
      Forward(hand.Surface(), pose, {0, 0, 1}, body);
      std::vector<int> joints(kJointsPerHand);
      std::iota(joints.begin(), joints.end(), HandBegin(side));
      JacobianMatrix expected;
      VertexJacobian(hand.Surface(), body, joints, expected);

      JacobianMatrix assembled = JacobianMatrix::Zero(3 * hand.NumVertices(), kHandDofs);
      for (std::size_t g = 0; g < hand.Groups().size(); ++g) {
        const HandModel::Group& group = hand.Groups()[g];
        for (std::size_t m = 0; m < group.vertices.size(); ++m) {
          for (std::size_t k = 0; k < group.joints.size(); ++k) {
            assembled.block<3, 3>(3 * group.vertices[m], 3 * group.joints[k]) =
                state.GroupJacobian(static_cast<int>(g)).block<3, 3>(3 * m, 3 * k);
          }
        }
      }
      EXPECT_LT((assembled - expected.leftCols(kHandDofs)).cwiseAbs().maxCoeff(), 1e-13);
    }
  }
}

TEST(FingerPose, GoesInAndOutOfABodyPose) {
  JointPose pose = RandomBodyPose(4);
  const FingerPose fingers = FingerPose::LinSpaced(0.0, 1.0);
  const JointPose before = pose;
  SetFingers(pose, Side::kLeft, fingers);
  EXPECT_EQ(FingersOf(pose, Side::kLeft), fingers);
  EXPECT_EQ(pose.leftCols(kLeftHandBegin), before.leftCols(kLeftHandBegin));
  EXPECT_EQ(pose.rightCols(kJointsPerHand), before.rightCols(kJointsPerHand));
}

}  // namespace
}  // namespace holdfast
