// SPDX-License-Identifier: MIT
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/support/imported.h"
#include "tests/support/program.h"

namespace holdfast::testing {
namespace {

using ::testing::HasSubstr;

using ImportCommand = ProgramTest;

std::string Quoted(const std::string& fixture) {
  return fmt::format("'{}'", Fixture(fixture).string());
}

TEST_F(ImportCommand, MakesAClipOfAResultOfImosThatFitsAndReports) {
  const nlohmann::json summary =
      folder.Json("import " + Quoted("torch/s3_mug_offhand_1.npz") + " -o mug.npz --fps 20");
  EXPECT_EQ(summary["format"], "IMoS result");
  EXPECT_EQ(summary["frames"], 29);
  EXPECT_EQ(summary["object"]["rotations"]["no_rotations"], 11);
  EXPECT_EQ(summary["object"]["rotations"]["first_frame"], 4);
  EXPECT_GT(summary["template_vertices"], 0);
  EXPECT_EQ(summary["subject"], "s3");

  // In this made-up sequence the object flies beside the hand.
  const std::string fit = "fit mug.npz mug --hand right --object-vertices 100 -o fitted --quiet";
  folder.Fails(fit + " --keep-grasp", 3, "--regrasp");
  // The clip is of another body: a new grasp is made.
  folder.Run(fit);
  folder.Run("report fitted -o report.html --quiet");
  EXPECT_GT(std::filesystem::file_size(folder / "report.html"), 100'000U);
}

TEST_F(ImportCommand, GrabNamesItsMeshOrCopiesIt) {
  const std::string sequence = Quoted("parameters/grab/grab/s1/mug_drink_1.npz");
  const nlohmann::json named = folder.Json("import " + sequence + " -o named.npz");
  const std::filesystem::path mesh = folder.Path() / named["object"]["mesh"].get<std::string>();
  EXPECT_EQ(ReadMesh(mesh).NumVertices(), 8);
  EXPECT_EQ(Listing(folder.Path()), "named.npz ");
  const nlohmann::json copied = folder.Json("import " + sequence + " -o copied.npz --copy-mesh");
  EXPECT_EQ(copied["object"]["mesh"], "copied_object.ply");
  EXPECT_EQ(ReadMesh(folder / "copied_object.ply").NumVertices(), 8);
  EXPECT_EQ(ReadClip(folder / "copied.npz").object->mesh, "copied_object.ply");
  EXPECT_EQ(copied["holding_frames"]["right"], 3);
  EXPECT_EQ(copied["holding_frames"]["left"], 2);
  EXPECT_TRUE(copied["has_table"]);
}

TEST_F(ImportCommand, ArcticsMeshInMillimetersComesInMeters) {
  const nlohmann::json summary = folder.Json(
      "import " +
      Quoted("parameters/arctic/data/arctic_data/data/raw_seqs/s01/box_grab_01.smplx.npy") +
      " -o box.npz");
  EXPECT_EQ(summary["object"]["mesh"], "box_object.ply");
  EXPECT_NEAR(ReadMesh(folder / "box_object.ply").vertices.row(0).maxCoeff(), 0.03, 1e-6);
}

TEST_F(ImportCommand, SaysWhatItRecognizedAndWhatItLeftOut) {
  const ProgramResult run =
      folder.Run("import " + Quoted("parameters/amass_smplh_poses.npz") + " -o a.npz");
  EXPECT_THAT(run.out, HasSubstr("AMASS, SMPL-H"));
  EXPECT_THAT(run.out, HasSubstr("jaw and eyes at rest"));
  EXPECT_THAT(run.out, HasSubstr("dmpls"));
}

// A record of WANDR's training data: CIRCLE's motions have a goal.
void WriteRecord(const std::filesystem::path& path, const std::string& bone, double goal_frame) {
  constexpr std::size_t kFrames = 61;
  std::vector<double> rots(kFrames * 66), trans(kFrames * 3);
  for (std::size_t t = 0; t < kFrames; ++t) {
    rots[66 * t] = std::numbers::pi / 2;  // upright, z up
    rots[66 * t + 3 * 17 + 2] = -0.02 * static_cast<double>(t);
    trans[3 * t + 1] = 0.01 * static_cast<double>(t);
    trans[3 * t + 2] = 1.0;
  }
  NpzWriter writer;
  writer.AddFloat64("rots", {kFrames, 66}, rots);
  writer.AddFloat64("trans", {kFrames, 3}, trans);
  writer.AddFloat64("fps", {}, {60.0});
  writer.AddFloat64("goal_frame", {}, {goal_frame});
  writer.AddText("target_bone", bone);
  writer.Write(path);
}

TEST_F(ImportCommand, KeepsTheGoalOfARecordOfWandrsData) {
  WriteRecord(folder / "record.npz", "RightHand", 40);
  const nlohmann::json summary = folder.Json("import record.npz --fps 30 -o clip.npz");
  EXPECT_EQ(summary["format"], "record of WANDR's training data");
  EXPECT_EQ(summary["goal"], nlohmann::json({{"frame", 20}, {"wrist", "right"}}));
  const NpzReader archive(folder / "clip.npz");
  EXPECT_EQ(archive.Read("goal_frame").AsDoubles(), std::vector<double>{20});
  EXPECT_EQ(archive.Read("goal_wrist").AsDoubles(), std::vector<double>{1});
  const Clip clip = ReadClip(folder / "clip.npz");
  const auto body = BodyModel::Default();
  BodyState state;
  ForwardJoints(body->RestJoints(body->Template()), clip.pose[20], clip.trans.col(20), state);
  const std::vector<double> goal = archive.Read("goal").AsDoubles();
  EXPECT_LT((Eigen::Map<const Eigen::Vector3d>(goal.data()) - state.joints.col(kRightWrist)).norm(),
            1e-6);
  for (const auto& [bone, frame, said] :
       {std::tuple{"Head", 40.0, "target_bone is 'Head'"},
        std::tuple{"LeftHand", 61.0, "goal_frame is 61, but there are 61 frames"}}) {
    WriteRecord(folder / "record.npz", bone, frame);
    const ProgramResult run = folder.Run("import record.npz -o other.npz --force");
    EXPECT_THAT(run.err, HasSubstr(said));
    EXPECT_FALSE(NpzReader(folder / "other.npz").Has("goal"));
  }
}

TEST_F(ImportCommand, FaultsNameFileFieldAndFix) {
  const auto fails = [&](const std::string& arguments, int code, const std::string& text) {
    folder.Fails("import " + arguments, code, text);
  };
  fails(Quoted("parameters/smplifyx") + " -o a.npz", 1, "--hand-model");
  fails(Quoted("parameters/vposer.pkl") + " -o a.npz", 1, "VPoser");
  fails(Quoted("parameters/humanml3d.npy") + " -o a.npz", 1, "HumanML3D");
  fails(Quoted("parameters/motion_x.npy") + " -o a.npz --up sideways", 2, "--up");
  fails(Quoted("parameters/motion_x.npy") + " -o a.npz --object-mesh mug.ply", 1, "no object");
  fails("nowhere.npz -o a.npz", 1, "does not exist");
}

}  // namespace
}  // namespace holdfast::testing
