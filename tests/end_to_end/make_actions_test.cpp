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
#include "tests/support/walking_figure.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramFolder;
using testing::ReadText;

class MakeActionsTest : public ::testing::Test {
 protected:
  void Make(const std::string& arguments) { folder_.Run("make-actions --quiet " + arguments); }
  void Refuses(const std::string& arguments, const char* said) {
    folder_.Fails("make-actions --quiet -o out " + arguments, 1, said);
  }
  nlohmann::json Manifest(const std::string& set) {
    return folder_.ReadJson(set + "/manifest.json");
  }

  ProgramFolder folder_;
};

TEST_F(MakeActionsTest, IsTheSameOnAnyNumberOfThreadsAndGoesOn) {
  const std::string asked = " --subjects 2 --actions lift,shake --objects cylinder";
  Make("-o one --count 4 --threads 1" + asked);
  Make("-o two --count 2 --threads 2" + asked);
  const auto first = std::filesystem::last_write_time(folder_ / "two" / "manifest.json");
  Make("-o two --count 4 --threads 2" + asked);
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
  Make(
      "-o made --count 2 --subjects 2 --actions lift --objects cylinder --starts captured "
      "--held-out bob --json");
  const nlohmann::json manifest = Manifest("made");
  EXPECT_EQ(manifest["people"]["held_out"], nlohmann::json({"bob"}));
  for (const auto& line : manifest["clips"]) {
    if (!line.contains("file")) continue;
    EXPECT_EQ(line["person"] == "bob", line["split"] == "held_out");
  }
}

TEST_F(MakeActionsTest, RefusesWhatItDoesNotKnow) {
  Refuses("--actions drnk", "drink");
  Refuses("--actions drink --objects sofa", "mug");
  std::filesystem::create_directories(folder_ / "empty");
  Refuses("--starts empty", "no clip");
  Refuses("--starts nowhere", "is not a folder");
  std::filesystem::create_directories(folder_ / "walk");
  WriteClip(testing::WalkingFigure(DefaultMeasures(), 60, 1.0), folder_ / "walk" / "walk.npz");
  Refuses("--starts walk", "stands");
  Refuses("--count 0", "--captured");
  Refuses("--count 0 --captured nowhere", "is not a folder");
  std::filesystem::create_directories(folder_ / "notes");
  std::ofstream(folder_ / "notes" / "table.csv") << "a,b\n1,2\n";
  Refuses("--count 0 --captured notes", "holds no recordings");
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
  Make("-o one --threads 1" + asked);
  Make("-o two --threads 2" + asked);
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

}  // namespace
}  // namespace holdfast
