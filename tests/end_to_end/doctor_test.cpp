// SPDX-License-Identifier: MIT
// `holdfast doctor` through the program.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/mano_like.h"
#include "tests/support/program.h"
#include "tests/support/robot_files.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::RunHoldfast;
using testing::TemporaryFolder;

TEST(DoctorCommand, AFittedFolderIsSoundAndTheNextCommandWorks) {
  const TemporaryFolder folder;
  ASSERT_EQ(RunHoldfast(folder.Path(), "fit demo_drink mug -o held --end 30 -q").exit_code, 0);
  const ProgramResult text = RunHoldfast(folder.Path(), "doctor held");
  EXPECT_EQ(text.exit_code, 0) << text.out;
  EXPECT_THAT(text.out, HasSubstr("held: result folder of Holdfast"));
  EXPECT_THAT(text.out, HasSubstr("acts on column vectors"));
  EXPECT_THAT(text.out, HasSubstr("next: holdfast render held -o held.mp4"));

  const ProgramResult result = RunHoldfast(folder.Path(), "doctor held/clip.npz --json");
  EXPECT_EQ(result.exit_code, 0);
  const nlohmann::json summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary["schema"], "holdfast/doctor/1");
  const nlohmann::json& file = summary["files"][0];
  EXPECT_EQ(file["verdict"], "ok") << file.dump(1);
  EXPECT_EQ(file["facts"]["frames"], 30);
  EXPECT_EQ(file["facts"]["object_rotation"], "column");
  EXPECT_EQ(file["facts"]["holding_hand"], "right");
}

// A robot's hand: what it is, what transfer makes of it, and the commands that do it.
TEST(DoctorCommand, DescribesARobotsHandAndTheNextCommandWorks) {
  const TemporaryFolder folder;
  std::filesystem::copy(
      std::filesystem::path(HOLDFAST_SOURCE_DIR) / "tests/fixtures/cases/doctor_robot/hand.urdf",
      folder / "hand.urdf");
  const ProgramResult text = RunHoldfast(folder.Path(), "doctor hand.urdf");
  EXPECT_EQ(text.exit_code, 0) << text.out;
  for (const char* said :
       {"hand.urdf: robot (URDF)", "13 links, 10 with a shape", "9 independent joints",
        "thumb: thumb1_joint 0 to 86 degrees", "3 fingers: thumb, index, middle", "a right hand",
        "contacts of ring and pinky are ignored",
        "next: holdfast transfer held --robot hand.urdf -o on_hand"}) {
    EXPECT_THAT(text.out, HasSubstr(said));
  }
  const auto json =
      nlohmann::json::parse(RunHoldfast(folder.Path(), "doctor hand.urdf --json").out)["files"][0];
  EXPECT_EQ(json["facts"]["joints"], 9);
  EXPECT_EQ(json["facts"]["fingers"], 3);
  EXPECT_EQ(json["facts"]["side"], "right");
  EXPECT_EQ(json["facts"]["joint_high"].size(), 9u);
  ASSERT_EQ(json["next"].size(), 2u);
  ASSERT_EQ(
      RunHoldfast(folder.Path(), "fit demo_drink mug -o held --end 4 -q --no-report").exit_code, 0);
  const int code =
      RunHoldfast(folder.Path(), "transfer held --robot hand.urdf -o on_hand -q").exit_code;
  EXPECT_TRUE(code == 0 || code == 3) << code;
  EXPECT_TRUE(std::filesystem::exists(folder / "on_hand/robot.npz"));
}

TEST(DoctorCommand, TellsWhatIsWrongWithARobotsFile) {
  const TemporaryFolder folder;
  const std::string whole = testing::BoxHand().Urdf();
  const auto doctor = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder / name) << text;
    return RunHoldfast(folder.Path(), "doctor " + name);
  };
  const std::string extra =
      "<link name=\"m\"><visual><geometry><mesh filename=\"package://hand/none.stl\"/></geometry>"
      "</visual><visual><geometry><mesh filename=\"nor.obj\"/></geometry></visual></link><joint "
      "name=\"f\" type=\"fixed\"><parent link=\"palm\"/><child link=\"m\"/></joint>";
  const ProgramResult missing = doctor("hand.urdf", testing::BoxHand{.extra = extra}.Urdf());
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.out, HasSubstr("2 referenced files are missing: "
                                     "package://hand/none.stl, nor.obj"));
  const ProgramResult named = doctor("hand.txt", whole);
  EXPECT_EQ(named.exit_code, 1);
  EXPECT_THAT(named.out, HasSubstr("rename it to .urdf"));
  const ProgramResult xacro =
      doctor("hand.xacro", "<robot><xacro:include filename=\"a\"/></robot>");
  EXPECT_EQ(xacro.exit_code, 1);
  EXPECT_THAT(xacro.out, HasSubstr("xacro hand.xacro > hand.urdf"));
  const ProgramResult arm = doctor("arm.urdf", "<robot name=\"x\"><link name=\"a\"/></robot>");
  EXPECT_EQ(arm.exit_code, 1);
  EXPECT_THAT(arm.out, HasSubstr("no movable joint"));
}

TEST(DoctorCommand, OneUnusableFileAmongSoundOnesIsExitCodeOne) {
  const TemporaryFolder folder;
  std::ofstream(folder / "empty.npz");
  std::ofstream(folder / "notes.txt") << "words\n";
  EXPECT_EQ(RunHoldfast(folder.Path(), "doctor notes.txt").exit_code, 1);  // nothing reads it
  const ProgramResult result =
      RunHoldfast(folder.Path(), "doctor notes.txt empty.npz missing.npz --json --threads 2");
  EXPECT_EQ(result.exit_code, 1);
  const nlohmann::json summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary["unsound"], 3);
  EXPECT_EQ(summary["with_warnings"], 0);
  ASSERT_EQ(summary["files"].size(), 3u);  // in the order given
  EXPECT_EQ(summary["files"][1]["file"], "empty.npz");
  EXPECT_EQ(summary["files"][1]["kind"], "empty file");
  EXPECT_EQ(RunHoldfast(folder.Path(), "doctor").exit_code, 2);
}

TEST(DoctorCommand, NamesThatAreNoTextAreStillJson) {
  const TemporaryFolder folder;
  std::ofstream(folder / "bad\xff.npz") << "x";
  const ProgramResult result = RunHoldfast(folder.Path(), "doctor bad*.npz --json");
  EXPECT_EQ(result.exit_code, 1) << result.err;  // a text, which nothing reads
  EXPECT_TRUE(nlohmann::json::accept(result.out)) << result.out;
}

// What it proposes for a hand alone works, with the hand's model beside the file.
TEST(DoctorCommand, WhatItProposesForAHandAloneWorks) {
  const TemporaryFolder folder;
  testing::WriteManoLike(folder / "MANO_LEFT.npz", Side::kLeft);
  ASSERT_EQ(RunHoldfast(folder.Path(), "convert demo_drink --to-body MANO_LEFT.npz -o hand.npz -q")
                .exit_code,
            0);
  const ProgramResult result = RunHoldfast(folder.Path(), "doctor hand.npz --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json file = nlohmann::json::parse(result.out)["files"][0];
  EXPECT_EQ(file["facts"]["needs_model"], "MANO_LEFT");
  ASSERT_FALSE(file["next"].empty());
  for (const nlohmann::json& next : file["next"]) {
    const std::string command = next.get<std::string>();
    ASSERT_TRUE(command.starts_with("holdfast ")) << command;
    const ProgramResult run = RunHoldfast(folder.Path(), command.substr(9));
    EXPECT_EQ(run.exit_code, 0) << command << "\n" << run.err;
  }
}

}  // namespace
}  // namespace holdfast
