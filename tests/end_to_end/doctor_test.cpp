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

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::RunHoldfast;

using DoctorCommand = testing::ProgramTest;

TEST_F(DoctorCommand, AFittedFolderIsSoundAndTheNextCommandWorks) {
  folder.Run("fit demo_drink mug -o held --end 30 -q");
  const ProgramResult text = folder.Run("doctor held");
  EXPECT_THAT(text.out, HasSubstr("held: result folder of Holdfast"));
  EXPECT_THAT(text.out, HasSubstr("acts on column vectors"));
  EXPECT_THAT(text.out, HasSubstr("next: holdfast render held -o held.mp4"));

  const nlohmann::json summary = folder.Json("doctor held/clip.npz");
  EXPECT_EQ(summary["schema"], "holdfast/doctor/1");
  const nlohmann::json& file = summary["files"][0];
  EXPECT_EQ(file["verdict"], "ok") << file.dump(1);
  EXPECT_EQ(file["facts"]["frames"], 30);
  EXPECT_EQ(file["facts"]["object_rotation"], "column");
  EXPECT_EQ(file["facts"]["holding_hand"], "right");
}

// A robot's hand: what it is, what transfer makes of it, and the commands that do it.
TEST_F(DoctorCommand, DescribesARobotsHandAndTheNextCommandWorks) {
  std::filesystem::copy(
      std::filesystem::path(HOLDFAST_SOURCE_DIR) / "tests/fixtures/cases/doctor_robot/hand.urdf",
      folder / "hand.urdf");
  const ProgramResult text = folder.Run("doctor hand.urdf");
  for (const char* said :
       {"hand.urdf: robot (URDF)", "13 links, 10 with a shape", "9 independent joints",
        "thumb: thumb1_joint 0 to 86 degrees", "3 fingers: thumb, index, middle", "a right hand",
        "the 3 human fingers that hold it best are used",
        "next: holdfast transfer held --robot hand.urdf -o on_hand"}) {
    EXPECT_THAT(text.out, HasSubstr(said));
  }
  const nlohmann::json json = folder.Json("doctor hand.urdf")["files"][0];
  EXPECT_EQ(json["facts"]["joints"], 9);
  EXPECT_EQ(json["facts"]["fingers"], 3);
  EXPECT_EQ(json["facts"]["side"], "right");
  EXPECT_EQ(json["facts"]["joint_high"].size(), 9u);
  ASSERT_EQ(json["next"].size(), 2u);
  folder.Run("fit demo_drink mug -o held --end 4 -q --no-report");
  const int code =
      RunHoldfast(folder.Path(), "transfer held --robot hand.urdf -o on_hand -q").exit_code;
  EXPECT_TRUE(code == 0 || code == 3) << code;
  EXPECT_TRUE(std::filesystem::exists(folder / "on_hand/robot.npz"));
}

TEST_F(DoctorCommand, TellsWhatIsWrongWithARobotsFile) {
  const auto expect = [&](const std::string& name, const std::string& text, const char* said) {
    std::ofstream(folder / name) << text;
    EXPECT_THAT(folder.Run("doctor " + name, 1).out, HasSubstr(said));
  };
  const std::string extra =
      "<link name=\"m\"><visual><geometry><mesh filename=\"package://hand/none.stl\"/></geometry>"
      "</visual><visual><geometry><mesh filename=\"nor.obj\"/></geometry></visual></link><joint "
      "name=\"f\" type=\"fixed\"><parent link=\"palm\"/><child link=\"m\"/></joint>";
  expect("hand.urdf", testing::BoxHand{.extra = extra}.Urdf(),
         "2 referenced files are missing: package://hand/none.stl, nor.obj");
  expect("hand.txt", testing::BoxHand().Urdf(), "rename it to .urdf");
  expect("hand.xacro", "<robot><xacro:include filename=\"a\"/></robot>",
         "xacro hand.xacro > hand.urdf");
  expect("arm.urdf", "<robot name=\"x\"><link name=\"a\"/></robot>", "no movable joint");
}

TEST_F(DoctorCommand, OneUnusableFileAmongSoundOnesIsExitCodeOne) {
  std::ofstream(folder / "empty.npz");
  std::ofstream(folder / "notes.txt") << "words\n";
  folder.Run("doctor notes.txt", 1);  // nothing reads it
  const nlohmann::json summary =
      folder.Json("doctor notes.txt empty.npz missing.npz --threads 2", 1);
  EXPECT_EQ(summary["unsound"], 3);
  EXPECT_EQ(summary["with_warnings"], 0);
  ASSERT_EQ(summary["files"].size(), 3u);  // in the order given
  EXPECT_EQ(summary["files"][1]["file"], "empty.npz");
  EXPECT_EQ(summary["files"][1]["kind"], "empty file");
  folder.Run("doctor", 2);
}

TEST_F(DoctorCommand, NamesThatAreNoTextAreStillJson) {
  std::ofstream(folder / "bad\xff.npz") << "x";
  const ProgramResult result =
      folder.Run("doctor bad*.npz --json", 1);  // a text, which nothing reads
  EXPECT_TRUE(nlohmann::json::accept(result.out)) << result.out;
}

// What it proposes for a hand alone works, with the hand's model beside the file.
TEST_F(DoctorCommand, WhatItProposesForAHandAloneWorks) {
  testing::WriteManoLike(folder / "MANO_LEFT.npz", Side::kLeft);
  folder.Run("convert demo_drink --to-body MANO_LEFT.npz -o hand.npz -q");
  const nlohmann::json file = folder.Json("doctor hand.npz")["files"][0];
  EXPECT_EQ(file["facts"]["needs_model"], "MANO_LEFT");
  ASSERT_FALSE(file["next"].empty());
  for (const nlohmann::json& next : file["next"]) {
    const std::string command = next.get<std::string>();
    ASSERT_TRUE(command.starts_with("holdfast ")) << command;
    folder.Run(command.substr(9));
  }
}

}  // namespace
}  // namespace holdfast
