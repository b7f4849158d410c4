// SPDX-License-Identifier: MIT
#include "solver/actions/action_choice.h"

#include <gtest/gtest.h>

#include "geometry/body/body_model.h"
#include "geometry/object/load_object.h"
#include "solver/actions/action_studio.h"
#include "solver/hand/hand_axes.h"

namespace holdfast {
namespace {

TEST(ActionGrasps, AHammerIsGrippedInThePalmWithTheThumbTowardsTheHead) {
  const LoadedObject hammer = LoadObject("hammer");
  const ActionProp prop =
      MakeActionProp("hammer", hammer.mesh, ForFitting(hammer, 300, nullptr), false, 2);
  const ActionActor actor(BodyModel::Default(), {});
  const HandModel& hand = actor.Hand(Side::kRight);
  std::vector<Grasp> grips = FindToolGrips(hand, prop, 1, 3, 2);
  ASSERT_FALSE(grips.empty());
  EXPECT_LE(grips.size(), 3u);
  const HandAxes axes(hand);
  for (const Grasp& grip : grips) {
    EXPECT_TRUE(grip.palm_touching);
    EXPECT_GT(axes.Across().dot(grip.wrist_from_object.linear() * prop.marks.forward), 0.5);
  }

  const std::size_t count = grips.size();
  AddTurnedOver(prop.marks, grips);
  ASSERT_EQ(grips.size(), 2 * count);
  const Eigen::Matrix3d before = grips[0].wrist_from_object.linear(),
                        after = grips[count].wrist_from_object.linear();
  EXPECT_LT((before * prop.marks.forward - after * prop.marks.forward).norm(), 1e-9);
  EXPECT_LT((before * prop.marks.facing + after * prop.marks.facing).norm(), 1e-9);
  EXPECT_EQ(grips[0].fingers, grips[count].fingers);

  std::vector<Grasp> of_a_mug(1);
  AddTurnedOver(MarksOf("mug", LoadObject("mug").mesh), of_a_mug);
  EXPECT_EQ(of_a_mug.size(), 1u);
}

}  // namespace
}  // namespace holdfast
