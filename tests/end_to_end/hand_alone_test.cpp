// SPDX-License-Identifier: MIT
// A hand that hangs on no body (MANO) through every command.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/container/npz.h"
#include "geometry/rotation.h"
#include "tests/support/mano_like.h"
#include "tests/support/program.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramFolder;
using testing::ProgramResult;

class HandAloneTest : public ::testing::Test {
 protected:
  HandAloneTest() {
    testing::WriteManoLike(folder_ / "MANO_RIGHT.npz", Side::kRight);
    testing::WriteManoLike(folder_ / "MANO_LEFT.npz", Side::kLeft);
  }
  ProgramFolder folder_;
};

TEST_F(HandAloneTest, GraspsAMugWithEitherHand) {
  for (const char* side : {"RIGHT", "LEFT"}) {
    const bool right = std::string(side) == "RIGHT";
    const std::string model = std::string("MANO_") + side + ".npz";
    const std::string output = std::string(side) + ".npz";
    const nlohmann::json grasp = folder_.Json("grasp mug --body " + model + " -o " + output);
    EXPECT_EQ(grasp["hand"], right ? "right" : "left");
    EXPECT_LT(grasp["contact"]["hand_in_object_max_mm"].get<double>(), 3.0);
    EXPECT_GT(grasp["contact"]["contact_ratio"].get<double>(), 0.0);
    const Clip clip = ReadClip(folder_ / output);
    EXPECT_EQ(clip.surface_model_type, "mano");
    EXPECT_EQ(clip.holding_hand[0], right ? kHoldsRight : kHoldsLeft);
    EXPECT_TRUE(clip.pose[0].middleCols<21>(1).isZero(0.0));
    // In the air, not on its own floor.
    const auto hand = BodyModel::Load(folder_ / model);
    BodyState state;
    Forward(BodySurface(hand), clip.pose[0], clip.trans.col(0), state);
    EXPECT_NEAR(state.joints(2, 0), 1.0, 1e-9);
    EXPECT_GT(state.vertices.row(2).minCoeff(), 0.5);
  }
}

TEST_F(HandAloneTest, AnEstimatedGraspIsTheFirstGraspOfABody) {
  const std::string fit = "fit demo_drink mug --end 20 --no-report --first-grasp ";
  const std::string of_mano = " --first-grasp-body MANO_RIGHT.npz ";
  folder_.Json("grasp mug --body MANO_RIGHT.npz -o grasp.npz");
  folder_.Json(fit + "grasp.npz" + of_mano + "-o held");
  const nlohmann::json metrics = folder_.ReadJson("held/metrics.json");
  EXPECT_EQ(metrics["grasp"]["status"], "given by grasp.npz");
  EXPECT_LT(metrics["grasp"]["min_distance_mm"].get<double>(), 1.0);

  // As GrabNet's estimates: parameters of a hand in the object's frame.
  const Clip clip = ReadClip(folder_ / "grasp.npz");
  const Eigen::Matrix3d R = ExpSO3(clip.object->orient.col(0));
  const auto mano = BodyModel::Load(folder_ / "MANO_RIGHT.npz");
  const Eigen::Vector3d root = mano->RestJoints(mano->ShapedVertices({})).col(0);
  const Eigen::Vector3d orient =
      LogSO3(R.transpose() * ExpSO3(Eigen::Vector3d(clip.pose[0].col(0))));
  const Eigen::Vector3d transl =
      R.transpose() * (root + clip.trans.col(0) - clip.object->trans.col(0)) - root;
  const FingerPose fingers = FingersOf(clip.pose[0], Side::kRight);
  const auto numbers = [](const auto& x) {
    return std::vector<double>(x.data(), x.data() + x.size());
  };
  NpzWriter writer;
  writer.AddFloat64("global_orient", {1, 3}, numbers(orient));
  writer.AddFloat64("transl", {1, 3}, numbers(transl));
  writer.AddFloat64("hand_pose", {1, 45}, numbers(fingers));
  writer.AddUint8("flat_hand_mean", {1}, {1});
  writer.Write(folder_ / "grabnet.npz");
  const ProgramResult again = folder_.Run(fit + "grabnet.npz" + of_mano + "-o again");
  EXPECT_THAT(again.err, HasSubstr("grabnet.npz has no object pose"));
  const Clip a = ReadClip(folder_ / "held/clip.npz"), b = ReadClip(folder_ / "again/clip.npz");
  EXPECT_LT((a.object->trans.col(0) - b.object->trans.col(0)).norm(), 1e-4);
  EXPECT_LT((a.pose[0] - b.pose[0]).cwiseAbs().maxCoeff(), 1e-3);

  folder_.Fails(fit + "grasp.npz --hand left" + of_mano + "-o no", 1, "of the right hand");
  folder_.Fails(fit + "grasp.npz --regrasp" + of_mano + "-o no", 2, "--regrasp");
  folder_.Fails(fit + "none.npz -o no", 1, "none.npz");
  // Of another object: the hand is far from this one, or in it.
  const ProgramResult other = folder_.Run(
      "fit demo_drink teapot --end 5 --no-report --first-grasp grasp.npz" + of_mano + "-o other",
      3);
  EXPECT_THAT(other.err, HasSubstr("the hand of grasp.npz is"));
}

TEST_F(HandAloneTest, CarriesAMugAsTheBodysHandDoesAndComesThroughEveryCommand) {
  const nlohmann::json converted =
      folder_.Json("convert demo_drink --to-body MANO_RIGHT.npz -o hand.npz");
  EXPECT_LT(converted["residual"]["max_mm"].get<double>(), 0.05);
  EXPECT_THAT(converted["not_carried_over"].dump(), HasSubstr("the body's motion"));
  const Clip source = ReadClip(folder_ / "hand.npz");
  folder_.Fails("convert no_clip.npz --to-body MANO_RIGHT.npz --layout smplx -o other.npz", 1,
                "layout smplx: the parameters are those of a mano model");

  const nlohmann::json fit = folder_.Json("fit hand.npz mug --body MANO_RIGHT.npz -o held");
  const nlohmann::json& summary = fit["summary"];
  EXPECT_EQ(summary["frames_failed"], 0);
  EXPECT_GE(summary["frames_in_contact_ratio"].get<double>(), 0.95);
  EXPECT_LT(summary["mean_max_penetration_depth_mm"].get<double>(), 3.0);
  const Clip held = ReadClip(folder_ / "held/clip.npz");
  EXPECT_EQ(held.surface_model_type, "mano");
  ASSERT_TRUE(held.object);
  // The hand's own way is untouched, and the object keeps its place in the hand.
  EXPECT_LT((held.trans - source.trans).cwiseAbs().maxCoeff(), 1e-9);
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (int t = 0; t < held.NumFrames(); ++t) {
    const auto frame = static_cast<std::size_t>(t);
    EXPECT_LT((held.pose[frame].col(0) - source.pose[frame].col(0)).norm(), 1e-9) << t;
    const Eigen::Vector3d in_hand = ExpSO3(held.pose[frame].col(0)).transpose() *
                                    (held.object->trans.col(t) - held.trans.col(t));
    if (t > 0) {
      EXPECT_LT((in_hand - before).norm(), 0.005) << t;
    }
    before = in_hand;
  }

  const std::string body = " --body MANO_RIGHT.npz";
  for (const std::string& command :
       {"render held -o sheet.png --sheet 2x1 --size 120x120" + body,
        "render held -o hand.png --frame 3 --camera hand --size 120x120" + body,
        "render held -o follow.png --frame 3 --camera follow --size 120x120" + body,
        "report held -o page.html" + body, "export held -o hand.glb" + body,
        "export held -o hand.bvh" + body, "refine held -o refined" + body}) {
    folder_.Run(command);
  }
  const nlohmann::json score = folder_.Json("score held" + body);
  EXPECT_THAT(score.dump(), HasSubstr("penetration"));
}

TEST_F(HandAloneTest, GoesBackOntoTheBody) {
  folder_.Run("convert demo_drink --to-body MANO_RIGHT.npz -o hand.npz");
  const nlohmann::json back = folder_.Json(
      "convert hand.npz --from-body MANO_RIGHT.npz --to-body MANO_RIGHT.npz -o same.npz");
  EXPECT_LT(back["residual"]["max_mm"].get<double>(), 1e-3);
  folder_.Fails("convert hand.npz --from-body MANO_RIGHT.npz --to-body MANO_LEFT.npz -o left.npz",
                1, "right hand");
}

TEST_F(HandAloneTest, WithoutAModelTheEmbeddedHandServes) {
  folder_.Run("convert demo_drink --to-body MANO_RIGHT.npz -o hand.npz");
  folder_.Run("fit hand.npz mug --end 30 -o held");
  EXPECT_THAT(folder_.Run("score held").out, HasSubstr("30, right"));
  folder_.Run("refine held -o refined");
  folder_.Run("transfer held --object cube -o cube");
  folder_.Run("render held -o held.png");
  folder_.Run("export held -o held.glb");
}

TEST_F(HandAloneTest, SaysWhatNeedsABody) {
  folder_.Run("convert demo_drink --to-body MANO_RIGHT.npz -o hand.npz");
  const std::pair<const char*, const char*> kFaults[] = {
      {"fit demo_drink mug --body MANO_RIGHT.npz -o a", "is a whole-body motion"},
      {"fit hand.npz mug --body MANO_RIGHT.npz --hand left -o a", "has no left hand"},
      {"fit hand.npz mug --body MANO_RIGHT.npz --hand both -o a", "has no left hand"},
      {"offhand hand.npz mug --body MANO_RIGHT.npz -o a", "has no left hand"},
      {"offhand hand.npz mug -o a", "has no left hand"},
      {"grasp mug --body MANO_LEFT.npz --hand right -o a.npz", "has no right hand"},
      {"grasp mug --body MANO_LEFT.npz --hand both -o a.npz", "has no right hand"},
      {"render demo_drink --body MANO_RIGHT.npz -o a.png", "is a whole-body motion"}};
  for (const auto& [command, said] : kFaults) folder_.Fails(command, 1, said);
}

}  // namespace
}  // namespace holdfast
