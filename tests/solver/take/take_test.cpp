// SPDX-License-Identifier: MIT
#include <cmath>

#include <gtest/gtest.h>

#include "generator/body/limb_ik.h"
#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "solver/take/take.h"
#include "solver/take/take_motion.h"
#include "solver/take/take_plan.h"
#include "tests/generator/test_body.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

struct Thing {
  explicit Thing(const std::string& name)
      : mesh(ReadMesh(std::string(HOLDFAST_MESHES_DIR "/objects/") + name + ".ply")),
        simplified(ReadMesh(std::string(HOLDFAST_MESHES_DIR "/objects/") + name + "_300.ply")),
        surface(mesh),
        fit(MakeFitObject(mesh, surface, simplified, 2)) {}
  TakeObject Object() const { return {mesh, surface, *fit.distance}; }

  TriangleMesh mesh, simplified;
  SignedDistance surface;
  FitObject fit;
};

const Thing& Bottle() {
  static const Thing bottle("bottle");
  return bottle;
}

const HandModel& RightHand() {
  static const HandModel hand(BodyModel::Default(), {}, Side::kRight);
  return hand;
}

// A bottle at arm's length before a person who stands at the origin and faces -y.
TakeRequest Request() {
  TakeRequest request;
  request.places = {{-0.2, -0.5, 1.0}, {-0.35, -0.4, 1.1}};
  request.pelvis = Vector3d(0.0, 0.6, 0.95);
  request.threads = 2;
  return request;
}

const TakePlan& Plan() {
  static const TakePlan plan = PlanTake(Request(), RightHand(), Bottle().Object());
  return plan;
}

// Somebody who stands and reaches for the plan's goals, 2 cm beside them, and stays a while.
TakeBodyMotion Standing(const TakePlan& plan) {
  std::vector<ReachKey> keys(6);
  const auto hand =
      HandOrientation(Side::kRight, Vector3d(0.2, -1.0, 0.0), Vector3d(0.0, 0.0, 1.0));
  const Vector3d hanging(-0.3, -0.05, 0.85), beside(0.02, 0.0, 0.0);
  const std::array<double, 6> times = {0.0, 1.6, 2.6, 4.0, 5.0, 5.4};
  const std::array<Vector3d, 6> wrists = {hanging,
                                          plan.goals[0].wrist + beside,
                                          plan.goals[0].wrist + beside,
                                          plan.goals[1].wrist + beside,
                                          plan.goals[1].wrist + beside,
                                          plan.goals[1].wrist + beside};
  for (std::size_t k = 0; k < keys.size(); ++k) {
    keys[k].time_s = times[k];
    keys[k].wrist = wrists[k];
    keys[k].hand = hand;
    keys[k].torso_lean_rad = k == 0 ? 0.0 : 0.15;
  }
  TakeBodyMotion motion;
  motion.states = wandr::StatesOfClip(MakeReachMotion(DefaultMeasures(), keys));
  motion.frames = {50, 122};
  return motion;
}

const TakeMotion& Motion() {
  static const TakeBodyMotion body = Standing(Plan());
  static const TakeMotion motion =
      MakeTakeMotion(Plan(), body, RightHand(), Bottle().Object(), Clip());
  return motion;
}

const Clip& Fitted() {
  static const Clip clip = FitTaken(Motion(), RightHand(), Bottle().fit, FitOptions());
  return clip;
}

Isometry3d WristIn(const Clip& clip, int frame) {
  BodyState state;
  ForwardJoints(DefaultMeasures().rest_joints, clip.pose[frame], clip.trans.col(frame), state);
  Isometry3d wrist = Isometry3d::Identity();
  wrist.linear() = state.world_rotation[21];
  wrist.translation() = state.joints.col(21);
  return wrist;
}

TEST(PlanTake, FindsAGraspThatAHandCanTakeFromATable) {
  const TakePlan& plan = Plan();
  ASSERT_TRUE(plan.Found());
  EXPECT_EQ(plan.take.fault, "");
  ASSERT_EQ(plan.goals.size(), 2u);
  const Isometry3d stands = Bottle().Object().Upright(plan.places[0], plan.take.yaw_rad);
  EXPECT_NEAR((stands * Bottle().mesh.vertices).row(2).minCoeff(), 1.0, 1e-9);
  EXPECT_LT((plan.goals[0].wrist - plan.take.WristFor(stands).translation()).norm(), 1e-12);
  // The closed and the ready hand, by their skin: above the table, out of the bottle.
  HandEvaluation hand = AtWrist(RightHand());
  for (const FingerPose& fingers : {plan.take.grasp.fingers, plan.take.approach.ready}) {
    const Eigen::Matrix3Xd skin =
        plan.take.WristFor(stands) * hand.At(fingers.data(), false).Vertices();
    EXPECT_GT(skin.row(2).minCoeff(), 1.0 - 0.006);
    EXPECT_GT(Bottle().surface.Distances(stands.inverse() * skin).minCoeff(), -0.004);
  }
  for (const TakeCandidate& candidate : plan.candidates) {
    EXPECT_TRUE(!candidate.fault.empty() || candidate.score <= plan.take.score);
  }
}

TEST(PlanTake, KeepsTheYawThatIsGivenAndIsTheSameOnAnyNumberOfThreads) {
  TakeRequest request = Request();
  request.object_yaw_rad = 1.1;
  request.threads = 1;
  const TakePlan one = PlanTake(request, RightHand(), Bottle().Object());
  request.threads = 3;
  const TakePlan three = PlanTake(request, RightHand(), Bottle().Object());
  ASSERT_TRUE(one.Found());
  EXPECT_FALSE(one.yaw_is_free);
  for (const TakeCandidate& candidate : one.candidates) EXPECT_EQ(candidate.yaw_rad, 1.1);
  EXPECT_EQ(one.take.grasp.fingers, three.take.grasp.fingers);
  EXPECT_EQ(one.take.score, three.take.score);
  EXPECT_EQ(one.goals[0].wrist, three.goals[0].wrist);
  EXPECT_EQ(one.take.approach.retreat, three.take.approach.retreat);
}

TEST(PlanTake, RefusesPlacesThatAreNone) {
  TakeRequest request = Request();
  request.places.clear();
  EXPECT_THROW(PlanTake(request, RightHand(), Bottle().Object()), Error);
  request.places = {{0.0, 1.0, -0.1}};
  EXPECT_THROW(PlanTake(request, RightHand(), Bottle().Object()), Error);
}

TEST(MakeTakeMotion, HasTheHandExactlyAtTheGraspWhenItTakes) {
  const TakeMotion& motion = Motion();
  EXPECT_EQ(motion.fault, "");
  const Isometry3d grasp = motion.take.WristFor(motion.standing.Transform());
  for (int t = motion.times.arrive; t <= motion.times.take; ++t) {
    const Isometry3d wrist = WristIn(motion.clip, t);
    EXPECT_LT((wrist.translation() - grasp.translation()).norm(), 1e-3) << t;
    EXPECT_LT(AngleBetween(wrist.linear(), grasp.linear()), 0.5 * kDegree) << t;
  }
  EXPECT_LT(
      (FingersOf(motion.clip.pose[motion.times.take], Side::kRight) - motion.take.grasp.fingers)
          .norm(),
      1e-9);
}

TEST(MakeTakeMotion, LeavesLegsAndTheRestOfTheMotionAlone) {
  const TakeBodyMotion body = Standing(Plan());
  const TakeMotion& motion = Motion();
  const wandr::StateMatrix<double> made = wandr::StatesOfClip(motion.clip);
  ASSERT_EQ(made.cols(), body.states.cols()) << "who stays is given no more time";
  for (int t = 0; t < motion.times.begin - 12; ++t) {
    EXPECT_LT((made.col(t) - body.states.col(t)).cwiseAbs().maxCoeff(), 1e-9) << t;
  }
  // No joint of the arm jumps where it leaves the motion's own.
  for (int t = 1; t < motion.clip.NumFrames(); ++t) {
    for (const int joint : {17, 19, 21}) {
      const double turn = AngleBetween(ExpSO3(motion.clip.pose[t].col(joint)),
                                       ExpSO3(motion.clip.pose[t - 1].col(joint)));
      EXPECT_LT(turn, 20.0 * kDegree) << joint << " at " << t;
    }
  }
}

TEST(MakeTakeMotion, SaysWhenTheBodyDoesNotComeThere) {
  TakeBodyMotion body = Standing(Plan());
  body.frames[1] = -1;
  EXPECT_NE(MakeTakeMotion(Plan(), body, RightHand(), Bottle().Object(), Clip()).fault, "");
  body.frames = {122, 50};
  EXPECT_NE(MakeTakeMotion(Plan(), body, RightHand(), Bottle().Object(), Clip()).fault, "");
}

TEST(FitTaken, StandsStillUntilItIsTakenAndDoesNotJump) {
  const Clip& clip = Fitted();
  const int take = Motion().times.take;
  for (int t = 1; t < take; ++t) {
    EXPECT_EQ(Vector3d(clip.object->trans.col(t)), Vector3d(clip.object->trans.col(0)));
    EXPECT_EQ(Vector3d(clip.object->orient.col(t)), Vector3d(clip.object->orient.col(0)));
    EXPECT_EQ(clip.holding_hand[t], 0);
  }
  EXPECT_EQ(clip.holding_hand[take], kHoldsRight);
  EXPECT_LT((clip.object->trans.col(take) - clip.object->trans.col(take - 1)).norm(), 1e-6);
  EXPECT_LT((clip.object->trans.col(take + 1) - clip.object->trans.col(take)).norm(), 2e-3);
  EXPECT_EQ(clip.NumFrames(), Motion().clip.NumFrames());
}

TEST(FitTaken, CarriesTheObjectUprightToItsPlaceClearOfTheTable) {
  const TakePlan& plan = Plan();
  const BodySurface body(BodyModel::Default(), {});
  const Clip& clip = Fitted();
  const TablePlacement placed = PlaceTable(plan.places[0], plan.approach_yaw_rad, 0.05,
                                           SkinNearTable(clip, body, plan.places[0], 2));
  const TakeMeasures measures =
      MeasureTake(clip, body, Side::kRight, Bottle().Object(), placed.table, Motion().times.take,
                  Motion().times.goals, plan.places, 2);
  EXPECT_EQ(measures.moved_before_take_mm, 0.0);
  EXPECT_LT(measures.object_in_table_mm, 1.5);
  EXPECT_LT(measures.hand_in_table_mm, 2.0);
  EXPECT_LT(measures.body_in_table_mm, 5.0);
  EXPECT_LT(measures.max_tilt_deg, 10.0);
  ASSERT_EQ(measures.goal_m.size(), 1u);
  EXPECT_LT(measures.goal_m[0], 0.02);
  EXPECT_LT(measures.max_acceleration, 25.0);
}

TEST(MeasureTake, SeesWhatIsWrong) {
  const TakePlan& plan = Plan();
  const BodySurface body(BodyModel::Default(), {});
  Clip clip = Fitted();
  const int take = Motion().times.take;
  clip.object->trans(2, take + 3) -= 0.02;   // into the table
  clip.object->trans(0, take - 5) += 0.004;  // before it is touched
  const SideTable table = TableAt(plan.places[0], plan.approach_yaw_rad, 0.1);
  const TakeMeasures measures = MeasureTake(clip, body, Side::kRight, Bottle().Object(), table,
                                            take, Motion().times.goals, plan.places, 2);
  EXPECT_NEAR(measures.moved_before_take_mm, 4.0, 1e-6);
  EXPECT_GT(measures.object_in_table_mm, 10.0);
  EXPECT_EQ(measures.object_in_table_frame, take + 3);
  EXPECT_NEAR(measures.max_acceleration, 0.02 * 900.0, 25.0);
  EXPECT_GT(measures.max_acceleration, 18.0);
}

TEST(MakeTakeMotion, IsTheSameEveryTime) {
  const TakeMotion again =
      MakeTakeMotion(Plan(), Standing(Plan()), RightHand(), Bottle().Object(), Clip());
  for (int t = 0; t < again.clip.NumFrames(); ++t) {
    ASSERT_EQ(again.clip.pose[t], Motion().clip.pose[t]) << t;
  }
  EXPECT_EQ(again.clip.object->trans, Motion().clip.object->trans);
}

}  // namespace
}  // namespace holdfast
