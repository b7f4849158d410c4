// SPDX-License-Identifier: MIT
// The other commands through the program, each on something embedded.
#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/support/data_folder.h"
#include "tests/support/program.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::ReadText;

using ImportCommand = testing::ProgramTest;
using RenderCommand = testing::ProgramTest;
using GraspCommand = testing::ProgramTest;

TEST_F(GraspCommand, WritesAClipThatFitCanCarryOn) {
  const nlohmann::json summary = folder.Json("grasp hammer -o held.npz --hand left -q");
  EXPECT_LT(summary["contact"]["hand_in_object_max_mm"].get<double>(), 3.0);
  EXPECT_GT(summary["contact"]["contact_ratio"].get<double>(), 0.02);
  const Clip clip = ReadClip(folder / "held.npz");
  EXPECT_EQ(clip.NumFrames(), 1);
  ASSERT_TRUE(clip.object.has_value());
  EXPECT_EQ(clip.holding_hand[0], kHoldsLeft);

  const nlohmann::json metrics =
      folder.Json("fit held.npz " + clip.object->mesh + " -o out --hand left -q");
  EXPECT_EQ(metrics["grasp"]["made"], false);
  EXPECT_EQ(metrics["summary"]["frames_in_contact_ratio"], 1.0);
}

TEST_F(GraspCommand, ManyThatAreInterruptedAreKept) {
  ProgramResult result;
  for (int seconds = 4; seconds < 300 && !std::filesystem::exists(folder / "many"); seconds *= 2) {
    result = folder.Run("grasp cube --count 1000000 --apart 0.1 --apart-angle 1 -o many --json",
                        130, "timeout --preserve-status -s INT " + std::to_string(seconds));
  }
  const nlohmann::json summary = nlohmann::json::parse(result.out);
  const auto found = summary["found"].get<std::size_t>();
  EXPECT_GT(found, 0u);
  EXPECT_LT(found, 1'000'000u);
  EXPECT_EQ(NpzReader(folder / "many/grasps.npz").Read("score").array.NumElements(), found);
  const std::string table = ReadText(folder / "many/grasps.csv");
  EXPECT_EQ(std::ranges::count(table, '\n'), static_cast<std::ptrdiff_t>(found + 1));
  EXPECT_GT(ReadClip(folder / "many/clip.npz").NumFrames(), 0);
  EXPECT_THAT(result.err, HasSubstr("interrupted: " + std::to_string(found) +
                                    " of the 1000000 requested grasps"));
}

TEST(DecimateCommand, SaysHowFarTheResultIsOff) {
  const ProgramFolder folder;
  const nlohmann::json summary = folder.Json("decimate mug -o mug.off --vertices 500");
  EXPECT_EQ(summary["vertices"]["after"], 500);
  EXPECT_GT(summary["hausdorff_mm"]["forward"].get<double>(), 0.0);
  EXPECT_LT(summary["hausdorff_mm"]["forward"].get<double>(), 3.0);
  EXPECT_EQ(ReadMesh(folder / "mug.off").NumVertices(), 500);
}

TEST_F(RenderCommand, DrawsASheet) {
  folder.Run("render demo_drink -o sheet.png --sheet 2x1 --size 80x120 -q");
  EXPECT_THAT(ReadText(folder / "sheet.png"), HasSubstr("PNG"));
}

TEST_F(RenderCommand, FollowsWhoWalksInASheet) {
  Clip clip = ReadClip(HOLDFAST_MESHES_DIR "/clips/demo_drink.npz");
  for (int t = 0; t < clip.NumFrames(); ++t) clip.trans(1, t) -= 0.02 * t;
  WriteClip(clip, folder / "walk.npz");
  const auto sheet = [&](const std::string& name, const std::string& options) {
    folder.Run("render walk.npz -o " + name + " --size 80x120 -q" + options);
    return ReadText(folder / name);
  };
  const std::string usual = sheet("usual.png", " --sheet 2x1");
  EXPECT_TRUE(usual == sheet("follow.png", " --sheet 2x1 --camera follow"));
  EXPECT_FALSE(usual == sheet("front.png", " --sheet 2x1 --camera front"));
  // Other pictures keep still, and a film asks for it.
  EXPECT_TRUE(sheet("one.png", " --frame 9") == sheet("same.png", " --frame 9 --camera front"));
}

TEST(BodyInfoCommand, DescribesTheEmbeddedBody) {
  const ProgramFolder folder;
  const nlohmann::json summary = folder.Json("body info");
  EXPECT_EQ(summary["joints"], 55);
  EXPECT_EQ(summary["right_hand_vertices"], summary["left_hand_vertices"]);
}

TEST_F(ImportCommand, ReportsWhatItMapped) {
  const auto motion = testing::DataFolder() / "mocap/accad_bvh/Female1_A01_Stand.bvh.gz";
  if (!std::filesystem::exists(motion)) {
    GTEST_SKIP() << motion << " is not there: set HOLDFAST_DATA to the folder with mocap/";
  }
  const ProgramResult result =
      folder.Run("import '" + motion.string() + "' -o stand.npz --fps 15 --json -q");
  EXPECT_EQ(nlohmann::json::parse(result.out)["skeleton"], "ACCAD");
  EXPECT_EQ(ReadClip(folder / "stand.npz").frame_rate, 15.0);
}

TEST(EveryCommand, HasHelpWithExamples) {
  const ProgramFolder folder;
  for (const char* command : {"fit", "grasp", "import", "convert", "decimate", "render",
                              "body info", "make-reach-data"}) {
    const ProgramResult result = folder.Run(std::string(command) + " --help");
    EXPECT_THAT(result.out, HasSubstr("Examples:")) << command;
    EXPECT_THAT(result.out, HasSubstr(std::string("holdfast ") + command)) << command;
    for (const char* option : {"--json", "--threads", "--seed", "--quiet"}) {
      EXPECT_THAT(result.out, HasSubstr(option)) << command;
    }
  }
}

}  // namespace
}  // namespace holdfast
