// SPDX-License-Identifier: MIT
#include "solver/actions/captured_clip.h"

#include <algorithm>
#include <fstream>

#include <gtest/gtest.h>

#include "generator/actions/standing_start.h"
#include "generator/body/limb_ik.h"
#include "generator/body/pose_builder.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "solver/actions/action_plan.h"
#include "solver/actions/captured_brush.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr int kOut = 30, kAt = 60, kHome = 90, kAll = 130;

// Somebody who faces +x with knees bent and moves the right hand from before the body to a place of
// the head (its frame, meters), stays from kAt to kHome - 1, and moves it back.
struct CapturedActionTest : ::testing::Test {
  std::shared_ptr<const BodyModel> model = BodyModel::Default();
  BodySurface surface{model};
  CapturedPerson person{surface.RestJoints(), FindFaceMarks(surface)};

  Clip MovesTo(const Vector3d& palm_in_head) const {
    Clip clip;
    clip.frame_rate = 30.0;
    clip.trans = Eigen::Matrix3Xd::Zero(3, kAll);
    clip.trans.row(0).setConstant(2.0);
    JointPose pose = JointPose::Zero();
    pose.col(0) = LogSO3(ExpSO3(Vector3d::UnitZ() * 90.0 * kDegree) *
                         ExpSO3(Vector3d::UnitX() * 90.0 * kDegree));
    for (const int hip : {kLeftHip, kRightHip}) pose(0, hip) = -80.0 * kDegree;
    for (const int knee : {kLeftKnee, kRightKnee}) pose(0, knee) = 80.0 * kDegree;
    pose(2, kRightShoulder) = 70.0 * kDegree;
    pose(2, kLeftShoulder) = -75.0 * kDegree;
    pose.col(kRightElbow) = 80.0 * kDegree * Arm(Side::kRight).hinge;
    BodyState state;
    ForwardJoints(person.rest_joints, pose, clip.trans.col(0), state);
    const Eigen::Isometry3d head = state.WorldFromJoint(kHead);
    // Fingers to the left and up, the palm to the body.
    const Eigen::Matrix3d hand = HandOrientation(
        Side::kRight, head.linear() * Vector3d(0.8, 0.6, 0.0), head.linear().col(1));
    const Vector3d rest = head * Vector3d(-0.18, -0.45, 0.35);
    const Vector3d there = head * palm_in_head - 0.08 * FingerDirection(Side::kRight, hand);
    for (int t = 0; t < kAll; ++t) {
      const double share = MinimumJerk((t - kOut) / static_cast<double>(kAt - kOut)) -
                           MinimumJerk((t - kHome) / 30.0);
      clip.pose.push_back(pose);
      EXPECT_LT(MoveWrist(person.rest_joints, Side::kRight, hand, rest + share * (there - rest),
                          clip.trans.col(t), clip.pose.back()),
                0.02);
    }
    return clip;
  }
  Vector3d OverHead() const { return person.face.eyes + Vector3d(-0.03, 0.14, -0.1); }
};

TEST_F(CapturedActionTest, FindsAHandThatGoesOverTheHead) {
  const auto found = FindCapturedAction(MovesTo(OverHead()), person);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->action, "brush");
  EXPECT_EQ(found->side, Side::kRight);
  // 0.3 s before the hand sets out; over the head a little before it stays, and after.
  EXPECT_NEAR(found->begin, kOut - 9 + 3, 4);
  EXPECT_LE(found->act, kAt);
  EXPECT_GT(found->act, kOut + 10);
  EXPECT_NEAR(found->key, (kAt + kHome) / 2, 3);
  EXPECT_GE(found->back, kHome);
  EXPECT_LT(found->back, kHome + 20);
  EXPECT_NEAR(found->end, kHome + 30 + 9 - 3, 5);
}

TEST_F(CapturedActionTest, FindsNothingInAHandBeforeTheBody) {
  EXPECT_FALSE(FindCapturedAction(MovesTo(Vector3d(-0.1, -0.4, 0.4)), person).has_value());
}

TEST_F(CapturedActionTest, KeepsTimingTrunkAndPlaceAtTheHeadOnAnotherBody) {
  const Clip clip = MovesTo(OverHead());
  const auto action = FindCapturedAction(clip, person);
  ASSERT_TRUE(action.has_value());
  Eigen::VectorXd betas = Eigen::VectorXd::Zero(model->NumShape());
  betas(0) = 1.8;
  const BodyMeasures body = MeasureBody(*model, betas);
  const FaceMarks face = FindFaceMarks(BodySurface(model, betas));
  const BodyFrame standing = IdleMotion(body, OwnStanding(body, 1), 1).front();
  for (const RestPosture posture : {RestPosture::kSeated, RestPosture::kStanding}) {
    const Clip moved = RetargetCaptured(clip, *action, person, body, face, posture, standing);
    ASSERT_EQ(moved.NumFrames(), action->end - action->begin);
    const int key = action->key - action->begin;
    BodyState was, is;
    ForwardJoints(person.rest_joints, clip.pose[action->key], clip.trans.col(action->key), was);
    ForwardJoints(body.rest_joints, moved.pose[key], moved.trans.col(key), is);
    const Vector3d in_head =
        is.WorldFromJoint(kHead).inverse() * Vector3d(is.joints.col(kRightWrist));
    const Vector3d before =
        was.WorldFromJoint(kHead).inverse() * Vector3d(was.joints.col(kRightWrist));
    // A hand behind the eyes is placed but for a hundredth of the way: else it is 1 cm off.
    EXPECT_LT((in_head - face.eyes - (before - person.face.eyes)).norm(), 1e-3);
    // It faces -y, at the origin, on the ground; knees as asked for.
    EXPECT_LT((is.world_rotation[kPelvis].col(2) + Vector3d::UnitY()).norm(), 0.05);
    EXPECT_LT(is.joints.col(kPelvis).head<2>().norm(), 1e-9);
    EXPECT_NEAR(
        std::min(is.joints.col(kLeftAnkle).z(), is.joints.col(kRightAnkle).z()),
        std::min(body.rest_joints(1, kLeftAnkle), body.rest_joints(1, kRightAnkle)) - body.sole_y,
        1e-9);
    const double knee = moved.pose[0].col(kLeftKnee).norm();
    EXPECT_EQ(knee > 1.0, posture == RestPosture::kSeated);
    // The other arm, and this one far from the head, move as they did.
    EXPECT_LT((moved.pose[key].col(kLeftElbow) - clip.pose[action->key].col(kLeftElbow)).norm(),
              1e-9);
    EXPECT_LT((moved.pose[0].col(kRightElbow) - clip.pose[action->begin].col(kRightElbow)).norm(),
              1e-9);
  }
}

TEST_F(CapturedActionTest, BrushesAreOnTheHeadWhileTheHandGoesOverIt) {
  const ActionActor actor(model, Eigen::VectorXd::Zero(10));
  const auto mesh = [](const std::string& name) {
    return ReadMesh(std::filesystem::path(HOLDFAST_MESHES_DIR) / "objects" / (name + ".ply"));
  };
  const ActionProp brush =
      MakeActionProp("toothbrush", mesh("toothbrush"), mesh("toothbrush_300"), false, 1);
  const HandModel& hand = actor.Hand(Side::kRight);
  const std::vector<Grasp> grasps = FindActionGrasps(hand, brush, 1, 6);
  ASSERT_FALSE(grasps.empty());
  const Clip clip = MovesTo(OverHead());
  const auto action = FindCapturedAction(clip, person);
  ASSERT_TRUE(action.has_value());
  Clip brushed = clip;
  const Grasp* const grasp =
      ServeBrush(actor, brush, grasps, Side::kRight, action->act, action->back, brushed);
  ASSERT_NE(grasp, nullptr);
  EXPECT_EQ(brushed.holding_hand, std::vector<std::uint8_t>(kAll, kHoldsRight));
  BodyState state, before;
  double shift_m = 0.0;
  for (int t = 0; t < kAll; ++t) {
    const auto at = static_cast<std::size_t>(t);
    ForwardJoints(person.rest_joints, brushed.pose[at], brushed.trans.col(t), state);
    ForwardJoints(person.rest_joints, clip.pose[at], clip.trans.col(t), before);
    shift_m =
        std::max(shift_m, (state.joints.col(kRightWrist) - before.joints.col(kRightWrist)).norm());
    const Eigen::Isometry3d held = state.WorldFromJoint(kRightWrist) * grasp->wrist_from_object;
    EXPECT_TRUE(held.isApprox(brushed.object->Pose(t), 1e-6)) << t;
    if (t >= action->act && t < action->back) {
      EXPECT_NEAR(BristlesFromHead(actor, brush.marks, brushed, t), 0.001, 0.004) << t;
    }
  }
  EXPECT_GT(shift_m, 0.01);
  // Long before and after, the arm is where it was.
  for (const std::size_t t : {std::size_t{0}, std::size_t{kAll - 1}}) {
    EXPECT_EQ(brushed.pose[t].col(kRightElbow), clip.pose[t].col(kRightElbow));
  }
  Clip none = clip;
  EXPECT_EQ(ServeBrush(actor, brush, {}, Side::kRight, action->act, action->back, none), nullptr);
  EXPECT_FALSE(none.object.has_value());
}

TEST(CapturedPlanTest, GivesThePeopleHeldOutToSubjectsHeldOut) {
  const testing::TemporaryFolder folder;
  for (const char* person : {"ann", "bob", "cyd"}) {
    std::filesystem::create_directories(folder / person);
    for (const char* name : {"x_static.csv", "x_1.csv", "x_2.csv", "notes.csv"}) {
      std::ofstream(folder / person / name)
          << (std::string(name) == "notes.csv" ? "a,b\n" : "Trajectories\n100\n");
    }
  }
  std::filesystem::remove(folder / "bob" / "x_static.csv");
  ActionSetOptions options;
  options.subjects = 4;
  options.captured = folder.Path().string();
  const std::vector<CapturedJob> jobs = PlanCaptured(options);
  ASSERT_EQ(jobs.size(), 12u);
  for (std::size_t k = 0; k < jobs.size(); ++k) {
    const CapturedJob& job = jobs[k];
    EXPECT_EQ(job.index, kMaxScripted + static_cast<int>(k));
    EXPECT_EQ(job.held_out, job.files.Person() == "cyd");
    EXPECT_EQ(IsHeldOut(job.subject, 4), job.held_out);
    EXPECT_EQ(job.files.still.empty(), job.files.Person() == "bob");
    EXPECT_EQ(job.posture, k % 2 == 0 ? RestPosture::kSeated : RestPosture::kStanding);
    EXPECT_EQ(job.files.recording, jobs[k ^ 1].files.recording);
  }
}

}  // namespace
}  // namespace holdfast
