// SPDX-License-Identifier: MIT
#include "solver/handover/hand_passage.h"

#include <array>

#include <gtest/gtest.h>

#include "generator/scripted/handover_motion.h"
#include "geometry/io/mesh/mesh_io.h"
#include "solver/grasp/grasp.h"

namespace holdfast {
namespace {

// A right hand that holds a ball from the middle of the clip on and stands still all the while: the
// clip's own wrist is in the ball before that.
struct Taking {
  HandModel hand{BodyModel::Default(), {}, Side::kRight};
  TriangleMesh ball = ReadMesh(HOLDFAST_MESHES_DIR "/objects/sphere.ply");
  SignedDistance surface{ball};
  DistanceGrid grid{surface, {.cell_m = 0.003}};
  Clip source, clip;

  Taking() {
    GraspOptions options;
    options.oppositions = 16;
    options.closings = 30;
    options.refinements = 4;
    const Grasp grasp = CloseHand(hand, ball, surface, grid, options);
    source.frame_rate = 30.0;
    source.pose.assign(40, JointPose::Zero());
    source.trans = Eigen::Matrix3Xd::Zero(3, 40);
    HandState state(hand);
    state.SetBody(source.pose[0], source.trans.col(0));
    const Eigen::Isometry3d ball_in_world = state.WorldFromWrist() * grasp.wrist_from_object;
    source.object.emplace();
    source.object->trans.setZero(3, 40);
    source.object->orient.setZero(3, 40);
    for (int t = 0; t < 40; ++t) source.object->SetPose(t, ball_in_world);
    for (JointPose& pose : source.pose) {
      SetFingers(pose, Side::kRight, 1.4 * grasp.fingers);  // deep in the ball
    }
    clip = source;
    clip.holding_hand.assign(40, 0);
    for (int t = 20; t < 40; ++t) {
      clip.holding_hand[t] = kHoldsRight;
      SetFingers(clip.pose[t], Side::kRight, grasp.fingers);
    }
  }

  double DepthIn(const Clip& of, int t) const {
    HandState state(hand);
    state.SetBody(of.pose[t], of.trans.col(t));
    state.Evaluate(FingersOf(of.pose[t], Side::kRight), false);
    const Eigen::Isometry3d object = of.object->Pose(t);
    return -surface.Distances(object.inverse() * state.Vertices()).minCoeff();
  }
};

TEST(ClearPassages, LeadsAHandToItsHoldOutsideTheObject) {
  Taking taking;
  const std::array<const HandModel*, 1> hands = {&taking.hand};
  ASSERT_GT(taking.DepthIn(taking.clip, 12), 0.004);
  const Clip before = taking.clip;
  ClearPassages(taking.source, hands, taking.grid, 0.4, taking.clip);
  for (int t = 8; t < 40; ++t) EXPECT_LT(taking.DepthIn(taking.clip, t), 0.002) << t;
  for (int t = 20; t < 40; ++t) EXPECT_EQ(taking.clip.pose[t], before.pose[t]);
  // The last step to the hold is a small one.
  HandState state(taking.hand);
  state.SetBody(taking.clip.pose[19], taking.clip.trans.col(19));
  const Eigen::Vector3d last = state.WristPosition();
  state.SetBody(taking.clip.pose[20], taking.clip.trans.col(20));
  EXPECT_LT((state.WristPosition() - last).norm(), 0.01);
}

}  // namespace
}  // namespace holdfast
