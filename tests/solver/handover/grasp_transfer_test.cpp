// SPDX-License-Identifier: MIT
#include "solver/handover/grasp_transfer.h"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "generator/scripted/handover_motion.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

const HandModel& Hand(Side side) {
  static const HandModel right(BodyModel::Default(), {}, Side::kRight);
  static const HandModel left(BodyModel::Default(), {}, Side::kLeft);
  return side == Side::kRight ? right : left;
}

struct Scene {
  explicit Scene(const std::string& name)
      : mesh(ReadMesh(HOLDFAST_MESHES_DIR "/objects/" + name + ".ply")),
        surface(mesh),
        grid(surface, {.cell_m = 0.0025, .threads = 2}),
        grasps(PalmGrasps(MeasureBody(*BodyModel::Default(), {}), mesh.vertices, 3)) {
    GraspOptions options;
    options.oppositions = 24;
    options.closings = 60;
    options.refinements = 8;
    options.use = GraspUse::kAny;
    options.style = GraspStyle::kPower;
    options.threads = 2;
    giver = CloseHand(Hand(Side::kRight), mesh, surface, grid, options);
  }
  // The other wrist comes from the other side, palm against palm.
  Eigen::Isometry3d Receiver() const {
    return grasps.left.wrist_from_object * grasps.right.wrist_from_object.inverse() *
           giver.wrist_from_object;
  }
  TriangleMesh mesh;
  SignedDistance surface;
  DistanceGrid grid;
  HandoverGrasps grasps;
  Grasp giver;
};

class TransferOf : public ::testing::TestWithParam<const char*> {};

TEST_P(TransferOf, TouchesTheObjectAndLeavesTheGiverRoom) {
  const Scene scene(GetParam());
  GraspTransferOptions options;
  options.threads = 2;
  const GraspTransfer transfer = TransferGrasp(
      Hand(Side::kRight), scene.giver.fingers, scene.giver.wrist_from_object, Hand(Side::kLeft),
      scene.Receiver(), scene.mesh, scene.surface, scene.grid, options);
  ASSERT_TRUE(transfer.found) << transfer.refused;
  RecordProperty("correction_mm", std::to_string(1000.0 * transfer.correction_m));

  // By exact distances, independent of the search's own numbers.
  const HandModel& hand = Hand(Side::kLeft);
  const HandAnatomy anatomy(hand);
  HandEvaluation evaluation = AtWrist(hand);
  const Eigen::Matrix3Xd vertices = transfer.grasp.wrist_from_object.inverse() *
                                    evaluation.At(transfer.grasp.fingers.data(), false).Vertices();
  const Eigen::VectorXd distance = scene.surface.Distances(vertices);
  EXPECT_GT(distance.minCoeff(), -0.002);
  std::array<bool, kNumFingers> touching{};
  for (int part = 0; part < kPalmPart; ++part) {
    for (const int i : anatomy.landmarks.Pad(part)) touching[part / 3] |= distance(i) < 0.0025;
  }
  EXPECT_TRUE(touching[kThumb]);
  EXPECT_GE(std::count(touching.begin(), touching.begin() + kThumb, true), 2);
  EXPECT_GT(transfer.grasp.wrench_quality, 0.0);

  HandEvaluation giver = AtWrist(Hand(Side::kRight));
  const SignedDistance giving(
      CloseHoles({scene.giver.wrist_from_object.inverse() *
                      giver.At(scene.giver.fingers.data(), false).Vertices(),
                  Hand(Side::kRight).Surface().Faces()}));
  EXPECT_GT(giving.Distances(vertices).minCoeff(), -options.max_hand_overlap_m - 1e-9);

  // What is reported is what lies between the wrist given and the wrist found.
  const Eigen::Vector3d moved = transfer.grasp.wrist_from_object.inverse().translation() -
                                scene.Receiver().inverse().translation();
  EXPECT_NEAR(transfer.correction_m, moved.norm(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Objects, TransferOf, ::testing::Values("apple", "mug", "sphere", "banana"),
                         [](const auto& test) { return std::string(test.param); });

TEST(TransferGrasp, StaysWhereAGoodWristIsGiven) {
  // A grasp that the receiving hand would choose itself, with the giver out of the way.
  const Scene scene("cylinder");
  GraspOptions search;
  search.oppositions = 24;
  search.closings = 60;
  search.refinements = 8;
  search.threads = 2;
  const Grasp own = CloseHand(Hand(Side::kLeft), scene.mesh, scene.surface, scene.grid, search);
  Eigen::Isometry3d away = scene.giver.wrist_from_object;
  away.translation() += Eigen::Vector3d(0.0, -0.5, 0.0);
  const GraspTransfer transfer =
      TransferGrasp(Hand(Side::kRight), MirrorFingers(own.fingers), away, Hand(Side::kLeft),
                    own.wrist_from_object, scene.mesh, scene.surface, scene.grid);
  EXPECT_TRUE(transfer.found) << transfer.refused;
  EXPECT_EQ(transfer.method, "mirrored");
  EXPECT_LT(transfer.correction_m, 0.015);
  EXPECT_EQ(transfer.hand_overlap_mm, 0.0);
}

TEST(TransferGrasp, RefusesTwoHandsOfOneSide) {
  const Scene scene("cube");
  EXPECT_THROW(
      TransferGrasp(Hand(Side::kLeft), scene.giver.fingers, scene.giver.wrist_from_object,
                    Hand(Side::kLeft), scene.Receiver(), scene.mesh, scene.surface, scene.grid),
      Error);
}

TEST(MirrorFingers, IsTheMirrorOfThePoseAndItsOwnInverse) {
  JointPose pose = JointPose::Random();
  const FingerPose right = FingersOf(pose, Side::kRight);
  EXPECT_EQ(MirrorFingers(right), FingersOf(MirrorPose(pose), Side::kLeft));
  EXPECT_EQ(MirrorFingers(MirrorFingers(right)), right);
}

}  // namespace
}  // namespace holdfast
