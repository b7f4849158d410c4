// SPDX-License-Identifier: MIT
#include "solver/carry/standing_grasp.h"

#include <gtest/gtest.h>

namespace holdfast {
namespace {

TEST(GraspStanding, GivesTheMugToAPersonOnTheGround) {
  const auto body = BodyModel::Default();
  GraspOptions options;
  options.threads = 2;
  const StandingGrasp held = GraspStanding(body, Side::kRight, LoadObject("mug"), options);
  ASSERT_EQ(held.report.status, GraspStatus::kFound);
  ASSERT_EQ(held.clip.NumFrames(), 1);
  EXPECT_EQ(held.clip.holding_hand.front(), kHoldsRight);
  EXPECT_EQ(held.clip.object->name, "mug");
  EXPECT_GT(held.clip.object->trans(2, 0), 0.7) << "before the waist";
  BodyState state;
  Forward(BodySurface(body), held.clip.pose[0], held.clip.trans.col(0), state);
  EXPECT_NEAR(state.vertices.row(2).minCoeff(), 0.0, 1e-9);
  EXPECT_LT(state.joints.col(0).head<2>().norm(), 1e-9) << "the pelvis over the origin";
  const int wrist = WristJoint(Side::kRight);
  EXPECT_LT((state.joints.col(wrist) - held.clip.object->trans.col(0)).norm(), 0.3);
}

}  // namespace
}  // namespace holdfast
