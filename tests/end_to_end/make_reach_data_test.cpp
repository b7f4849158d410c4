// SPDX-License-Identifier: MIT
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "geometry/clip/clip.h"
#include "geometry/io/container/npz.h"
#include "tests/generator/test_body.h"
#include "tests/support/capture_folder.h"
#include "tests/support/program.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::ReadText;

class MakeReachDataTest : public ::testing::Test {
 protected:
  MakeReachDataTest() { testing::WriteCaptures(folder_ / "captures"); }

  void Make(const std::string& arguments) { folder_.Run(kMake + arguments); }

  const std::string kMake = "make-reach-data captures --held-out bob --quiet ";

  ProgramFolder folder_;
};

TEST_F(MakeReachDataTest, IsTheSameOnAnyNumberOfThreadsAndWhenItGoesOn) {
  Make("-o one --hours 0.02 --threads 1");
  Make("-o two --hours 0.02 --threads 3");
  // Half of it, something lost, and then all.
  Make("-o parts --hours 0.01");
  Make("-o parts --hours 0.02");
  const auto manifest = folder_.ReadJson("one/manifest.json");
  EXPECT_TRUE(manifest["complete"]);
  int files = 0;
  for (const auto& line : manifest["clips"]) {
    if (!line.contains("file")) continue;
    ++files;
    const std::string name = line["file"];
    const std::string bytes = ReadText(folder_ / "one" / name);
    EXPECT_EQ(ReadText(folder_ / "two" / name), bytes) << name;
    EXPECT_EQ(ReadText(folder_ / "parts" / name), bytes) << name;
  }
  EXPECT_GT(files, 0);
  for (const char* same : {"two", "parts"}) {
    EXPECT_EQ(ReadText(folder_ / same / "manifest.json"),
              ReadText(folder_ / "one" / "manifest.json"));
  }
}

// A right wrist is at the goal in the frame that the file says, and stays there.
TEST_F(MakeReachDataTest, OptimizedReachesAreAtTheirGoals) {
  Make("-o one --hours 0.01 --optimized 4 --threads 1");
  Make("-o parts --hours 0.01 --optimized 2 --threads 2");
  std::filesystem::remove(folder_ / "parts" / "optimized" / "reach_00000.npz");  // is made again
  Make("-o parts --hours 0.01 --optimized 4 --threads 2");
  const std::filesystem::path folder = folder_ / "one" / "optimized";
  const std::string text = ReadText(folder / "manifest.json");
  EXPECT_EQ(ReadText(folder_ / "parts" / "optimized" / "manifest.json"), text);
  const auto manifest = nlohmann::json::parse(text);
  ASSERT_EQ(manifest["clips"].size(), 4u);
  int files = 0;
  for (const auto& line : manifest["clips"]) {
    ASSERT_NE(line.contains("file"), line.contains("dropped"));
    if (!line.contains("file")) continue;
    ++files;
    const std::string name = line["file"];
    EXPECT_EQ(ReadText(folder_ / "parts" / "optimized" / name), ReadText(folder / name)) << name;
    const NpzReader archive(folder / name);
    const std::vector<double> goal = archive.Read("goal").AsDoubles();
    const auto due = static_cast<int>(archive.Read("goal_frame").AsDoubles().at(0));
    EXPECT_EQ(archive.Read("goal_wrist").AsDoubles().at(0), 1.0);
    const BodyModel& body = *BodyModel::Default();
    const auto bones = wandr::BoneOffsetsOf(MeasureBody(body, {}).rest_joints).Cast<float>();
    const wandr::StateMatrix<float> states =
        wandr::StatesOfClip(ReadClip(folder / name)).cast<float>();
    const Eigen::MatrixXf joints = wandr::JointsOfStates(states, bones);
    for (const int frame : {due, static_cast<int>(states.cols()) - 1}) {
      const Eigen::Vector3d wrist =
          joints.col(frame).segment<3>(3 * WristJoint(Side::kRight)).cast<double>();
      EXPECT_LT((wrist - Eigen::Map<const Eigen::Vector3d>(goal.data())).norm(), 0.021) << name;
    }
  }
  EXPECT_GT(files, 1);
}

TEST_F(MakeReachDataTest, LabelsGoalsAndKeepsHeldOutSubjectsAway) {
  EXPECT_GT(folder_.Json(kMake + "-o made --hours 0.01")["summary"]["hours"], 0.01);
  EXPECT_TRUE(
      std::filesystem::exists(folder_ / "made" / "captured" / "held_out" / "walk_other.npz"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "made" / "captured" / "train" / "walk.npz"));
  const auto manifest = folder_.ReadJson("made/manifest.json");
  for (const auto& line : manifest["clips"]) {
    if (!line.contains("file")) continue;
    EXPECT_THAT(line["sources"].dump(), Not(HasSubstr("walk_other")));
    const NpzReader archive(folder_ / "made" / line["file"].get<std::string>());
    const Clip clip = ReadClip(archive);
    const std::vector<double> goals = archive.Read("goal").AsDoubles();
    const std::vector<std::int64_t> frames = archive.Read("goal_frame").AsIntegers();
    ASSERT_EQ(goals.size(), 3 * frames.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
      BodyState state;
      ForwardJoints(DefaultMeasures().rest_joints, clip.pose[frames[k]], clip.trans.col(frames[k]),
                    state);
      EXPECT_LT((state.joints.col(21) - Eigen::Vector3d(&goals[3 * k])).norm(), 0.01);
    }
  }
  folder_.Fails(kMake + "-o made --hours 0.01 --seed 2", 1, "--force");
}

TEST_F(MakeReachDataTest, AFullDiskIsNotTheClipsFault) {
  const ProgramResult result =
      folder_.Run(kMake + "-o made --hours 0.01", 1, "trap '' XFSZ; ulimit -f 8;");
  EXPECT_THAT(result.err, HasSubstr("could not be written"));
  EXPECT_THAT(result.err, HasSubstr("made/captured/"));
}

TEST_F(MakeReachDataTest, KeepsAClipByNameAway) {
  folder_.Run("make-reach-data captures -o made --hours 0.01 --pace 0.9 --quiet --held-out low");
  EXPECT_TRUE(std::filesystem::exists(folder_ / "made" / "captured" / "held_out" / "low.npz"));
  const auto manifest = folder_.ReadJson("made/manifest.json");
  EXPECT_EQ(manifest["options"]["pace"], 0.9);
  for (const auto& line : manifest["clips"]) {
    if (!line.contains("file")) continue;
    EXPECT_THAT(line["sources"].dump(), Not(HasSubstr("low")));
  }
}

TEST_F(MakeReachDataTest, SaysWhatIsWrong) {
  folder_.Fails("make-reach-data nowhere -o x", 1, "is not a folder");
  // The imported clips stay for the next attempt.
  EXPECT_THAT(folder_.Run("make-reach-data captures --held-out eve -o x", 1).err,
              HasSubstr("Subjects: ann, bob"));
  std::filesystem::remove(folder_ / "captures" / "low.npz");
  std::filesystem::remove(folder_ / "captures" / "walk.npz");
  folder_.Fails("make-reach-data captures -o z", 1,
                "index.csv: lists 5 files, of which 2 are missing: walk.npz, low.npz");
  std::ofstream(folder_ / "captures" / "index.csv") << "file,subject\nstand.npz\n";
  folder_.Fails("make-reach-data captures -o y", 1, "index.csv, line 2");
}

}  // namespace
}  // namespace holdfast
