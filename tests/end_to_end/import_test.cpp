// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "geometry/io/mesh/mesh_io.h"
#include "tests/support/imported.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::testing {
namespace {

using ::testing::HasSubstr;

std::string Quoted(const std::string& fixture) {
  return fmt::format("'{}'", Fixture(fixture).string());
}

nlohmann::json ImportJson(const TemporaryFolder& folder, const std::string& arguments) {
  const ProgramResult run = RunHoldfast(folder.Path(), "import " + arguments + " --json");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return nlohmann::json::parse(run.out);
}

TEST(ImportCommand, MakesAClipOfAResultOfImosThatFitsAndReports) {
  const TemporaryFolder folder;
  const nlohmann::json summary =
      ImportJson(folder, Quoted("torch/s3_mug_offhand_1.npz") + " -o mug.npz --fps 20");
  EXPECT_EQ(summary["format"], "IMoS result");
  EXPECT_EQ(summary["frames"], 29);
  EXPECT_EQ(summary["object"]["rotations"]["no_rotations"], 11);
  EXPECT_EQ(summary["object"]["rotations"]["first_frame"], 4);
  EXPECT_GT(summary["template_vertices"], 0);
  EXPECT_EQ(summary["subject"], "s3");

  // In this made-up sequence the object flies beside the hand.
  const std::string fit = "fit mug.npz mug --hand right --object-vertices 100 -o fitted --quiet";
  const ProgramResult astray = RunHoldfast(folder.Path(), fit + " --keep-grasp");
  EXPECT_EQ(astray.exit_code, 3);
  EXPECT_THAT(astray.err, ::testing::HasSubstr("--regrasp"));
  EXPECT_FALSE(std::filesystem::exists(folder / "fitted"));
  // The clip is of another body: a new grasp is made.
  const ProgramResult fitted = RunHoldfast(folder.Path(), fit);
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const ProgramResult report = RunHoldfast(folder.Path(), "report fitted -o report.html --quiet");
  ASSERT_EQ(report.exit_code, 0) << report.err;
  EXPECT_GT(std::filesystem::file_size(folder / "report.html"), 100'000U);
}

TEST(ImportCommand, GrabNamesItsMeshOrCopiesIt) {
  const TemporaryFolder folder;
  const std::string sequence = Quoted("parameters/grab/grab/s1/mug_drink_1.npz");
  const nlohmann::json named = ImportJson(folder, sequence + " -o named.npz");
  const std::filesystem::path mesh = folder.Path() / named["object"]["mesh"].get<std::string>();
  EXPECT_EQ(ReadMesh(mesh).NumVertices(), 8);
  EXPECT_EQ(Listing(folder.Path()), "named.npz ");
  const nlohmann::json copied = ImportJson(folder, sequence + " -o copied.npz --copy-mesh");
  EXPECT_EQ(copied["object"]["mesh"], "copied_object.ply");
  EXPECT_EQ(ReadMesh(folder / "copied_object.ply").NumVertices(), 8);
  EXPECT_EQ(ReadClip(folder / "copied.npz").object->mesh, "copied_object.ply");
  EXPECT_EQ(copied["holding_frames"]["right"], 3);
  EXPECT_EQ(copied["holding_frames"]["left"], 2);
  EXPECT_TRUE(copied["has_table"]);
}

TEST(ImportCommand, ArcticsMeshInMillimetersComesInMeters) {
  const TemporaryFolder folder;
  const nlohmann::json summary = ImportJson(
      folder, Quoted("parameters/arctic/data/arctic_data/data/raw_seqs/s01/box_grab_01.smplx.npy") +
                  " -o box.npz");
  EXPECT_EQ(summary["object"]["mesh"], "box_object.ply");
  EXPECT_NEAR(ReadMesh(folder / "box_object.ply").vertices.row(0).maxCoeff(), 0.03, 1e-6);
}

TEST(ImportCommand, SaysWhatItRecognizedAndWhatItLeftOut) {
  const TemporaryFolder folder;
  const ProgramResult run = RunHoldfast(
      folder.Path(), "import " + Quoted("parameters/amass_smplh_poses.npz") + " -o a.npz");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("AMASS, SMPL-H"));
  EXPECT_THAT(run.out, HasSubstr("jaw and eyes at rest"));
  EXPECT_THAT(run.out, HasSubstr("dmpls"));
}

TEST(ImportCommand, FaultsNameFileFieldAndFix) {
  const TemporaryFolder folder;
  const auto fails = [&](const std::string& arguments, int code, const std::string& text) {
    const ProgramResult run = RunHoldfast(folder.Path(), "import " + arguments);
    EXPECT_EQ(run.exit_code, code) << arguments;
    EXPECT_THAT(run.err, HasSubstr(text)) << arguments;
    EXPECT_EQ(Listing(folder.Path()), "") << arguments;
  };
  fails(Quoted("parameters/smplifyx") + " -o a.npz", 1, "--hand-model");
  fails(Quoted("parameters/vposer.pkl") + " -o a.npz", 1, "VPoser");
  fails(Quoted("parameters/humanml3d.npy") + " -o a.npz", 1, "HumanML3D");
  fails(Quoted("parameters/motion_x.npy") + " -o a.npz --up sideways", 2, "--up");
  fails(Quoted("parameters/motion_x.npy") + " -o a.npz --object-mesh mug.ply", 1, "no object");
  fails("nowhere.npz -o a.npz", 1, "does not exist");
}

TEST(ImportCommand, TheSameFileGivesTheSameBytes) {
  const TemporaryFolder folder;
  const std::string file = "import " + Quoted("torch/s10_mug_drink_1.npz");
  ASSERT_EQ(RunHoldfast(folder.Path(), file + " -o a.npz --threads 1").exit_code, 0);
  ASSERT_EQ(RunHoldfast(folder.Path(), file + " -o b.npz --threads 4").exit_code, 0);
  EXPECT_EQ(ReadText(folder / "a.npz"), ReadText(folder / "b.npz"));
}

}  // namespace
}  // namespace holdfast::testing
