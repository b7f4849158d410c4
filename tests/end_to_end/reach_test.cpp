// SPDX-License-Identifier: MIT
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "geometry/clip/clip.h"
#include "tests/support/program.h"
#include "tests/support/wandr_scene.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::Listing;
using ::testing::Not;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;

// A folder with random weights: they move somehow, always the same.
class ReachCommand : public ::testing::Test {
 protected:
  ReachCommand() {
    WriteNetwork(wandr::testing::SmallNetwork(wandr::IntentionLayout::kFlagged, 3),
                 folder_ / "net.safetensors");
  }
  ProgramResult Reach(const std::string& arguments, int exit_code = 0) const {
    return folder_.Run(kReach + arguments, exit_code);
  }

  const std::string kReach = "reach --weights net.safetensors --no-report ";
  ProgramFolder folder_;
};

TEST_F(ReachCommand, WarnsOfANetworkFromBeforeThePelvisMoved) {
  const std::string reach = "--goal 0.3,-1.5,1.1 --samples 1 -f -o out";
  EXPECT_THAT(Reach(reach).err, Not(HasSubstr("pelvis")));
  wandr::NetworkWeights old = wandr::ReadNetwork(folder_ / "net.safetensors");
  old.notes["made_by"] = "holdfast train wandr 0.1.0";
  WriteNetwork(old, folder_ / "net.safetensors");
  const ProgramResult result = Reach(reach);
  EXPECT_THAT(result.err,
              HasSubstr("warning: net.safetensors: was trained with an older rest pelvis"));
}

TEST_F(ReachCommand, WritesAResultFolderThatOtherCommandsRead) {
  EXPECT_THAT(Reach("--goal 0.3,-1.5,1.1 --goal -0.5,-2,0.8 --samples 4 --all -o out").out,
              HasSubstr("of 2 goals reached with the right wrist"));
  EXPECT_EQ(Listing(folder_ / "out"), "clip.npz metrics.json samples ");
  EXPECT_EQ(Listing(folder_ / "out/samples"), "00.npz 01.npz 02.npz 03.npz ");
  EXPECT_EQ(ReadText(folder_ / "out/clip.npz"), ReadText(folder_ / "out/samples/00.npz"));
  const nlohmann::json metrics = folder_.ReadJson("out/metrics.json");
  EXPECT_EQ(metrics["schema"], "holdfast/reach/1");
  ASSERT_EQ(metrics["goals"].size(), 2u);
  const Clip clip = ReadClip(folder_ / "out/clip.npz");
  EXPECT_EQ(static_cast<int>(metrics["per_frame"]["goal_distance_m"].size()), clip.NumFrames());
  EXPECT_EQ(clip.frame_rate, 30.0);
  // What metrics say about the wrist is what the clip's wrist does.
  const BodyMeasures& body = wandr::testing::DefaultBody();
  const wandr::StateMatrix<double> states = wandr::StatesOfClip(clip);
  const Eigen::Vector3d wrist = wandr::WristPosition(
      wandr::testing::DefaultBones(), wandr::PoseOf<double>(states.col(7)), Side::kRight);
  EXPECT_NEAR(metrics["per_frame"]["goal_distance_m"][7].get<double>(),
              (wrist - Eigen::Vector3d(0.3, -1.5, 1.1)).norm(), 1e-4);
  // It begins standing at the origin.
  EXPECT_LT((states.col(0) - wandr::StateOf(wandr::StandingPose(body))).cwiseAbs().maxCoeff(),
            1e-5);
  folder_.Run("score out");

  Reach("--goal 1,1,1 -o out", 1);  // is there already
  Reach("--goal 1,1,1 --samples 1 -o out --force");
}

TEST_F(ReachCommand, TheSameSeedGivesTheSameBytesOnAnyThreads) {
  const std::string goal = "--goal 0.3,-1.5,1.1 --samples 20 --quiet ";
  Reach(goal + "--threads 1 -o a");
  Reach(goal + "--threads 3 -o b");
  Reach(goal + "--threads 3 --seed 2 -o c");
  EXPECT_EQ(ReadText(folder_ / "a/clip.npz"), ReadText(folder_ / "b/clip.npz"));
  EXPECT_EQ(ReadText(folder_ / "a/metrics.json"), ReadText(folder_ / "b/metrics.json"));
  EXPECT_NE(ReadText(folder_ / "a/clip.npz"), ReadText(folder_ / "c/clip.npz"));
}

TEST_F(ReachCommand, FollowsAGoalThatMovesAsFarAsItIsKnown) {
  const auto write = [&](const std::string& name, int goals) {
    std::ofstream file(folder_ / name);
    file << "time,x,y,z\n";
    for (int t = 0; t < goals; ++t) file << t / 30.0 << "," << 0.01 * t << ",-0.5,1.1\n";
  };
  write("long.csv", 40);
  write("short.csv", 25);
  const std::string more = " --push 10,0.1,0,0 --seed 3";
  const ProgramResult result = Reach("--track long.csv -o long" + more);
  Reach("--track short.csv -o short" + more);
  EXPECT_THAT(result.out, HasSubstr("after the first second"));
  const nlohmann::json metrics = folder_.ReadJson("long/metrics.json");
  EXPECT_EQ(metrics["schema"], "holdfast/reach-track/1");
  EXPECT_EQ(metrics["per_frame"]["goal_distance_m"].size(), 41u);
  const Clip longer = ReadClip(folder_ / "long/clip.npz"),
             shorter = ReadClip(folder_ / "short/clip.npz");
  ASSERT_EQ(longer.NumFrames(), 41);
  ASSERT_EQ(shorter.NumFrames(), 26);
  for (int t = 0; t < 26; ++t) EXPECT_EQ(longer.pose[t], shorter.pose[t]) << t;
  Reach("--track long.csv --goal 1,1,1 -o out", 2);
  Reach("--track long.csv --time 3 -o out", 2);
  Reach("--push 1,0,0,0 --goal 1,1,1 -o out", 2);
  Reach("-o out", 2);
  folder_.Fails(kReach + "--track none.csv -o out", 1, "none.csv");
  EXPECT_THAT(
      RunHoldfast(folder_.Path(), kReach + "--track short.csv --push 99,0.1,0,0 -o out").err,
      HasSubstr("25 goals"));
}

TEST_F(ReachCommand, ATrackThatIsInterruptedKeepsItsMotion) {
  {
    std::ofstream file(folder_ / "hour.csv");
    for (int t = 0; t < 50'000; ++t) file << 0.5 * std::sin(0.01 * t) << ",-0.5,1.1\n";
  }
  ProgramResult result;
  for (int seconds = 2; seconds < 200 && !std::filesystem::exists(folder_ / "hour"); seconds *= 2) {
    result = folder_.Run("reach --track hour.csv -o hour", 130,
                         "timeout --preserve-status -s INT " + std::to_string(seconds));
  }
  const nlohmann::json metrics = folder_.ReadJson("hour/metrics.json");
  const auto frames = metrics["summary"]["frames"].get<int>();
  EXPECT_GT(frames, 0);
  EXPECT_LT(frames, 50'000);
  EXPECT_EQ(metrics["summary"]["interrupted"], true);
  EXPECT_EQ(ReadClip(folder_ / "hour/clip.npz").NumFrames(), frames + 1);
  EXPECT_THAT(result.err,
              HasSubstr("interrupted after " + std::to_string(frames) + " of 50000 goals"));
  EXPECT_THAT(result.out, HasSubstr("hour/clip.npz: moving goal followed"));
}

TEST_F(ReachCommand, TheLeftWristIsMeasuredWhereItIs) {
  Reach("--goal 0.3,-1.5,1.1 --wrist left --samples 1 -o left");
  const nlohmann::json metrics = folder_.ReadJson("left/metrics.json");
  const wandr::StateMatrix<double> states =
      wandr::StatesOfClip(ReadClip(folder_ / "left/clip.npz"));
  const wandr::Pose<double> pose = wandr::PoseOf<double>(states.col(40));
  const Eigen::Vector3d goal(0.3, -1.5, 1.1);
  const Eigen::Vector3d wrist =
      wandr::WristPosition(wandr::testing::DefaultBones(), pose, Side::kLeft);
  EXPECT_NEAR(metrics["per_frame"]["goal_distance_m"][40].get<double>(), (wrist - goal).norm(),
              1e-4);
}

TEST_F(ReachCommand, GoesOnFromAClip) {
  Reach("--goal 0,-1,1 --from demo_drink:40 --samples 1 -o on");
  const wandr::StateMatrix<double> from =
      wandr::StatesOfClip(ReadClip(HOLDFAST_MESHES_DIR "/clips/demo_drink.npz"));
  const wandr::StateMatrix<double> on = wandr::StatesOfClip(ReadClip(folder_ / "on/clip.npz"));
  EXPECT_LT((on.col(0) - from.col(40)).cwiseAbs().maxCoeff(), 1e-4);
  // A clip of one frame is a pose at rest.
  Clip one = ReadClip(HOLDFAST_MESHES_DIR "/clips/demo_drink.npz");
  one.pose.resize(1);
  one.trans.conservativeResize(Eigen::NoChange, 1);
  one.object.reset();
  one.holding_hand.clear();
  WriteClip(one, folder_ / "one.npz");
  Reach("--goal 0,-1,1 --from one.npz --samples 1 -o first");
}

TEST_F(ReachCommand, AClipInMillimetersIsRefusedForItsUnits) {
  Clip clip = ReadClip(HOLDFAST_MESHES_DIR "/clips/demo_drink.npz");
  clip.trans *= 1000.0;
  WriteClip(clip, folder_ / "mm.npz");
  const ProgramResult result = Reach("--goal 0,-1,1 --from mm.npz --samples 1 -o on", 1);
  EXPECT_THAT(result.err, HasSubstr("mm.npz: its positions are in millimeters"));
  EXPECT_THAT(result.err, HasSubstr("holdfast import mm.npz --meters-per-unit 0.001"));
}

TEST_F(ReachCommand, BadInputIsNamed) {
  const auto fails = [&](const std::string& arguments, int code, const std::string& says) {
    folder_.Fails(kReach + "-o bad " + arguments, code, says);
  };
  fails("--goal 100,0,1", 1, "100.0 m away");
  fails("--goal 1,0,-0.3", 1, "below the ground");
  fails("--goal nan,0,1", 1, "not three finite numbers");
  fails("--goal 1,2", 1, "not three finite numbers");
  fails("--goal 1,2,1x", 1, "not three finite numbers");
  fails("--goal 1,1,1 --time 0", 2, "--time");
  fails("--goal 1,1,1 --from demo_drink:9999", 1, "has frames 0 to");
  fails("--goal 1,1,1 --from demo_drink:x", 1, "frame number");
  fails("--goal 1,1,1 --from nowhere.npz", 1, "nowhere.npz");
  fails("", 2, "--goal");
  const ProgramResult high = Reach("--goal 7,0,2.9 --samples 1 -o high");
  EXPECT_THAT(high.err, HasSubstr("higher than"));
  EXPECT_THAT(high.err, HasSubstr("7.0 m away"));

  wandr::NetworkWeights broken = wandr::testing::SmallNetwork(wandr::IntentionLayout::kFlagged, 3);
  broken.statistics.body_transl.mean.z() = NAN;
  WriteNetwork(broken, folder_ / "net.safetensors");
  fails("--goal 1,1,1", 1, "'statistics.body_transl.mean' holds nan");
  std::ofstream(folder_ / "net.safetensors") << "text";
  fails("--goal 1,1,1", 1, "net.safetensors");
  std::filesystem::remove(folder_ / "net.safetensors");
  fails("--goal 1,1,1", 1, "net.safetensors");
}

}  // namespace
}  // namespace holdfast
