// SPDX-License-Identifier: MIT
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/actions/face_marks.h"
#include "geometry/clip/clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "tests/support/program.h"

namespace holdfast {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;

// Nearest that the middle of the object's rim comes to the mouth, meters.
double RimToMouth(const std::filesystem::path& result) {
  const Clip clip = ReadClip(result / "clip.npz");
  const BodySurface body(BodyModel::Default(), {});
  const FaceMarks face = FindFaceMarks(body);
  const ObjectMarks object = MarksOf("mug", ReadMesh(result / "object.ply"));
  double nearest = 1e9;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    BodyState state;
    ForwardJoints(body.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    const Eigen::Vector3d mouth = state.joints.col(15) + state.world_rotation[15] * face.mouth;
    const Eigen::Vector3d rim =
        ExpSO3(clip.object->orient.col(t)) * object.rim + clip.object->trans.col(t);
    nearest = std::min(nearest, (rim - mouth).norm());
  }
  return nearest;
}

TEST(Synthesize, APersonDrinksFromAMug) {
  const ProgramFolder folder;
  const nlohmann::json summary =
      folder.Json("synthesize --action drink --object mug -o drunk --samples 4 --no-and-back -q");
  EXPECT_EQ(summary["synthesis"]["action"], "drink");
  EXPECT_EQ(summary["synthesis"]["object"], "mug");
  EXPECT_EQ(summary["synthesis"]["samples"].size(), 4u);
  EXPECT_EQ(summary["summary"]["frames_in_contact_ratio"], 1.0) << summary["summary"];
  EXPECT_LT(summary["synthesis"]["at_face_mm"], 15.0);
  EXPECT_THAT(ReadText(folder / "drunk/report.html"), HasSubstr("drink"));
  const Clip clip = ReadClip(folder / "drunk/clip.npz");
  EXPECT_EQ(clip.action, "drink");
  EXPECT_DOUBLE_EQ(clip.frame_rate, 30.0);
  for (const std::uint8_t hands : clip.holding_hand) EXPECT_EQ(hands, kHoldsRight);
  EXPECT_LT(RimToMouth(folder / "drunk"), 0.10);

  // Somebody who has a mug in the hand can go on from there.
  folder.Run(
      "synthesize --action inspect --object mug --from drunk:0 --samples 2 --no-report -o seen -q");
  EXPECT_LT((ReadClip(folder / "seen/clip.npz").trans.col(0) - clip.trans.col(0)).norm(), 1e-3);
}

TEST(Synthesize, TheSameBytesOnAnyThreads) {
  const ProgramFolder folder;
  for (const char* threads : {"1", "2"}) {
    folder.Run(
        "synthesize 'The person lifts the cube' --start table --samples 3 "
        "--no-report -q --seed 4 --threads " +
        std::string(threads) + " -o out" + threads);
  }
  EXPECT_EQ(ReadText(folder / "out1/clip.npz"), ReadText(folder / "out2/clip.npz"));
}

TEST(Synthesize, LeftHandsAndOtherBodiesHoldToo) {
  const ProgramFolder folder;
  const ProgramResult result = folder.Run(
      "synthesize --action eat --object apple --hand left --betas 1.5,-0.5 --samples 2 "
      "--no-and-back "
      "--no-report -q -o eaten");
  const Clip clip = ReadClip(folder / "eaten/clip.npz");
  for (const std::uint8_t hands : clip.holding_hand) EXPECT_EQ(hands, kHoldsLeft);
  EXPECT_DOUBLE_EQ(clip.betas[0], 1.5);
  EXPECT_THAT(result.out, HasSubstr("\n  at the face "));
  const nlohmann::json metrics = folder.ReadJson("eaten/metrics.json");
  EXPECT_EQ(metrics["summary"]["frames_in_contact_ratio"], 1.0);
  EXPECT_THAT(result.out, EndsWith("\n"));
}

TEST(Synthesize, SaysWhatIsWrong) {
  const ProgramFolder folder;
  const auto fails = [&](const std::string& arguments, int code, const std::string& message) {
    folder.Fails("synthesize -o out " + arguments, code, message);
  };
  fails("--action drnk --object mug", 1, "Did you mean 'drink'?");
  fails("--action fly --object mug", 1, "--action: no motion can be generated for 'fly'");
  fails("'The person flies the mug'", 1, "no motion can be generated for 'fly'");
  fails("--action fly --object mug", 1, "The nearest action is 'shake'");
  for (const char* wrong : {"--action drnk --object mug", "--action fly --object mug",
                            "'The person swims with the mug'"}) {
    const std::string said = RunHoldfast(folder.Path(), std::string("synthesize ") + wrong).err;
    EXPECT_THAT(said, ::testing::Not(HasSubstr("staple"))) << "it was not trained on that";
    EXPECT_THAT(said, HasSubstr("switchON, cook, toast, chop")) << "in the vocabulary's order";
  }
  fails("--action drink --object mugg", 1, "mugg: is neither a file nor an embedded object");
  fails("'The person drinks from the sea'", 1, "object");
  fails("--action drink", 2, "--object");
  fails("", 2, "--action");
  fails("--action drink --object mug --object-scale 9", 3, "no room for a hand");
  fails("--action drink --object mug --from demo_drink", 1, "no object track");
  fails("--action drink --object mug --from nowhere.npz", 1, "nowhere.npz");
  fails("--action drink --object mug --weights nowhere.safetensors", 1, "nowhere");
  fails("--action drink --object mug --betas 1,2,3,4,5,6,7,8,9,10,11,12,13", 1, "--betas");
}

}  // namespace
}  // namespace holdfast
