// SPDX-License-Identifier: MIT
#include <filesystem>
#include <fstream>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/imos/action_set.h"
#include "geometry/clip/clip.h"
#include "tests/generator/test_body.h"
#include "tests/support/data_folder.h"
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

// One person's trials and the static one, from the shared recordings; false where they are absent.
bool LayCaptured(const std::filesystem::path& folder, const std::string& person,
                 const std::vector<std::string>& trials) {
  const std::filesystem::path from = testing::DataFolder() / "adl" / person;
  std::filesystem::create_directories(folder / person);
  for (const std::string& trial : trials) {
    const std::filesystem::path file = from / (person + trial + ".csv.gz");
    if (!std::filesystem::exists(file)) return false;
    std::filesystem::copy(file, folder / person);
  }
  return true;
}

TEST_F(MakeActionsTest, TakesArmsOfPeopleWhoDrink) {
  if (!LayCaptured(folder_ / "adl", "ADL009", {"_static", "DR1"})) {
    GTEST_SKIP() << "adl/ADL009 is not there: set HOLDFAST_DATA to the folder with adl/";
  }
  // Nobody's static trial, and a file that is cut off: reported, the rest is made.
  std::filesystem::create_directories(folder_ / "adl" / "lone");
  std::filesystem::copy(folder_ / "adl" / "ADL009" / "ADL009DR1.csv.gz", folder_ / "adl" / "lone");
  std::ofstream(folder_ / "adl" / "ADL009" / "torn.csv") << "Trajectories\n100\n";
  const std::string asked = " --count 0 --subjects 2 --captured adl";
  ASSERT_EQ(Make("-o one --threads 1" + asked).exit_code, 0);
  ASSERT_EQ(Make("-o two --threads 2" + asked).exit_code, 0);
  const nlohmann::json manifest = Manifest("one");
  EXPECT_EQ(Manifest("two"), manifest);
  ASSERT_EQ(manifest["clips"].size(), 6u);
  EXPECT_EQ(manifest["summary"]["captured"]["of"], 6);
  std::map<std::string, std::string> reasons;
  for (const auto& line : manifest["clips"]) {
    EXPECT_EQ(line["source"], "captured");
    if (!line.contains("file")) {
      reasons[line["person"].get<std::string>() + "/" + line["trial"].get<std::string>()] =
          line["tries_dropped"][0]["detail"];
      continue;
    }
    EXPECT_EQ(line["trial"], "ADL009DR1");
    EXPECT_EQ(line["action"], "drink");
    EXPECT_EQ(line["hand"], "right");
    EXPECT_EQ(line["captured"], nlohmann::json({"trunk", "right_arm", "left_arm"}));
    EXPECT_LT(line["key_worst_mm"].get<double>(), 25.0);
    EXPECT_LT(line["act_frame"], line["key_frame"]);
    EXPECT_LT(line["key_frame"], line["return_frame"]);
    const std::string file = line["file"];
    EXPECT_EQ(ReadText(folder_ / "two" / file), ReadText(folder_ / "one" / file)) << file;
    const Clip clip = ReadClip(folder_ / "one" / file);
    EXPECT_EQ(clip.action, "drink");
    EXPECT_EQ(clip.subject, line["subject"].get<std::string>());
    EXPECT_EQ(clip.NumFrames(), line["frames"].get<int>());
    EXPECT_EQ(clip.holding_hand[line["key_frame"].get<std::size_t>()], kHoldsRight);
    EXPECT_EQ(clip.holding_hand.front(), 0);
    const bool bent = clip.pose.front().col(kLeftKnee).norm() > 1.0;
    EXPECT_EQ(bent, line["posture"] == "seated");
  }
  EXPECT_THAT(reasons["lone/ADL009DR1"], HasSubstr("static trial"));
  EXPECT_THAT(reasons["ADL009/torn"], HasSubstr("torn.csv"));
  EXPECT_GE(manifest["summary"]["captured"]["clips"].get<int>(), 1);
  const imos::ActionSet set = imos::ReadActionSet({folder_ / "one"}, BodyModel::Default());
  EXPECT_EQ(static_cast<int>(set.train.size() + set.validation.size() + set.notes.size()),
            manifest["summary"]["captured"]["clips"].get<int>());
}

TEST_F(MakeActionsTest, RefusesCapturesWithoutRecordings) {
  ProgramResult result = Make("-o out --count 0");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("--captured"));
  result = Make("-o out --count 0 --captured nowhere");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("is not a folder"));
  std::filesystem::create_directories(folder_ / "notes");
  std::ofstream(folder_ / "notes" / "table.csv") << "a,b\n1,2\n";
  result = Make("-o out --count 0 --captured notes");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("holds no recordings"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

}  // namespace
}  // namespace holdfast
