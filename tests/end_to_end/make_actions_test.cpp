// SPDX-License-Identifier: MIT
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "tests/generator/test_body.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/walking_figure.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;
using testing::TemporaryFolder;

class MakeActionsTest : public ::testing::Test {
 protected:
  ProgramResult Make(const std::string& arguments) {
    return RunHoldfast(folder_.Path(), "make-actions --quiet " + arguments);
  }
  nlohmann::json Manifest(const std::string& set) {
    return nlohmann::json::parse(ReadText(folder_ / set / "manifest.json"));
  }

  TemporaryFolder folder_;
};

TEST_F(MakeActionsTest, IsTheSameOnAnyNumberOfThreadsAndGoesOn) {
  const std::string asked = " --subjects 2 --actions lift,shake --objects cylinder";
  ASSERT_EQ(Make("-o one --count 4 --threads 1" + asked).exit_code, 0);
  ASSERT_EQ(Make("-o two --count 2 --threads 2" + asked).exit_code, 0);
  const auto first = std::filesystem::last_write_time(folder_ / "two" / "manifest.json");
  ASSERT_EQ(Make("-o two --count 4 --threads 2" + asked).exit_code, 0);
  EXPECT_GT(std::filesystem::last_write_time(folder_ / "two" / "manifest.json"), first);
  const nlohmann::json manifest = Manifest("one");
  EXPECT_TRUE(manifest["complete"]);
  EXPECT_EQ(Manifest("two"), manifest);
  int files = 0;
  for (const auto& line : manifest["clips"]) {
    if (!line.contains("file")) continue;
    ++files;
    const std::string name = line["file"];
    EXPECT_EQ(ReadText(folder_ / "two" / name), ReadText(folder_ / "one" / name)) << name;
    const Clip clip = ReadClip(folder_ / "one" / name);
    EXPECT_EQ(clip.action, line["action"].get<std::string>());
    EXPECT_EQ(clip.subject, line["subject"].get<std::string>());
    EXPECT_EQ(clip.object->name, "cylindermedium");
    EXPECT_EQ(clip.object->mesh, "cylinder");
    EXPECT_EQ(clip.frame_rate, 30.0);
    const std::string stem = clip.subject + "/cylindermedium_" + clip.action + "_";
    EXPECT_THAT(name, HasSubstr(stem));
    const bool left = line["hand"] == "left";
    EXPECT_EQ(clip.holding_hand.front(), left ? kHoldsLeft : kHoldsRight);
  }
  EXPECT_GT(files, 1);
}

TEST_F(MakeActionsTest, StartsFromCapturedPeopleAndKeepsThemApart) {
  for (const char* person : {"ann", "bob", "cyd"}) {
    std::filesystem::create_directories(folder_ / "captured" / person);
    WriteClip(testing::StandingFigure(DefaultMeasures(), 120),
              folder_ / "captured" / person / "stand.npz");
  }
  const ProgramResult result = Make(
      "-o made --count 2 --subjects 2 --actions lift --objects cylinder --starts captured "
      "--held-out bob --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json manifest = Manifest("made");
  EXPECT_EQ(manifest["people"]["held_out"], nlohmann::json({"bob"}));
  for (const auto& line : manifest["clips"]) {
    if (!line.contains("file")) continue;
    EXPECT_EQ(line["person"] == "bob", line["split"] == "held_out");
  }
}

TEST_F(MakeActionsTest, RefusesWhatItDoesNotKnow) {
  ProgramResult result = Make("-o out --actions drnk");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("drink"));
  result = Make("-o out --actions drink --objects sofa");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("mug"));
  std::filesystem::create_directories(folder_ / "empty");
  result = Make("-o out --starts empty");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("no clip"));
  result = Make("-o out --starts nowhere");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("is not a folder"));
  std::filesystem::create_directories(folder_ / "walk");
  WriteClip(testing::WalkingFigure(DefaultMeasures(), 60, 1.0), folder_ / "walk" / "walk.npz");
  result = Make("-o out --starts walk");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("stands"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

}  // namespace
}  // namespace holdfast
