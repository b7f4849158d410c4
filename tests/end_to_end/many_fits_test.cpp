// SPDX-License-Identifier: MIT
// Fits from a list, with both hands, and from hand to hand.
#include <algorithm>
#include <cstdlib>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "tests/support/program.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::RunHoldfast;

using FitBatch = testing::ProgramTest;
using Batch = testing::ProgramTest;
using FitCommand = testing::ProgramTest;
using OffhandCommand = testing::ProgramTest;

// A short clip that holds an apple, and a list of twelve fits of it with one that cannot be done.
void MakeList(const ProgramFolder& folder) {
  folder.Run("fit demo_drink apple -o held --end 16 --no-report -q");
  std::ofstream list(folder / "list.txt");
  list << "# clip object\n";
  for (int k = 0; k < 12; ++k) {
    list << "held/clip.npz held/object.ply hand=right start=" << k << " name=job" << k << "\n";
  }
  list << "held/clip.npz missing.obj name=bad\n";
}

// Status lines, in .jobs, tell how long each job took.
bool SameFolders(const ProgramFolder& folder, const char* a, const char* b) {
  const std::string command =
      "cd '" + folder.Path().string() + "' && diff -r -x .jobs " + a + " " + b + " > .diff";
  return std::system(command.c_str()) == 0;
}

TEST_F(FitBatch, GoesOnPastABadClipAndSaysSo) {
  MakeList(folder);
  const ProgramResult result = folder.Run("fit --batch list.txt -o out", 1);
  EXPECT_THAT(result.err, HasSubstr("missing.obj"));
  EXPECT_THAT(result.out, HasSubstr("13 jobs, 1 failed"));
  const nlohmann::json manifest = folder.ReadJson("out/manifest.json");
  ASSERT_EQ(manifest["jobs"].size(), 13u);
  EXPECT_EQ(manifest["jobs"][0]["status"], "done");
  EXPECT_EQ(manifest["jobs"][12]["status"], "failed");
  EXPECT_THAT(manifest["jobs"][12]["fault"].get<std::string>(), HasSubstr("missing.obj"));
  EXPECT_TRUE(std::filesystem::exists(folder / "out" / "job11" / "clip.npz"));
  EXPECT_FALSE(std::filesystem::exists(folder / "out" / "bad"));
  // Options are not mixed, other folders not touched.
  folder.Fails("fit --batch list.txt -o out -q --lambda-contact 1", 1, "another list, options");
  folder.Fails("fit --batch list.txt -o held -q", 1, "not the folder of a batch");
  EXPECT_TRUE(std::filesystem::exists(folder / "held" / "clip.npz"));
}

TEST_F(FitBatch, KilledAndStartedAgainEndsWithTheSameBytes) {
  MakeList(folder);
  folder.Run("fit --batch list.txt -o whole -q --threads 2", 1);
  int left_undone = 0;
  for (const char* after : {"0.15", "0.3", "0.6", "1.0"}) {
    const std::string kill = std::string("timeout -s KILL ") + after;
    RunHoldfast(folder.Path(), "fit --batch list.txt -o killed -q --threads 1", kill);
    left_undone += !std::filesystem::exists(folder / "killed" / "job11");
  }
  EXPECT_GT(left_undone, 0) << "never killed before the end";
  folder.Run("fit --batch list.txt -o killed -q --threads 2", 1);
  EXPECT_TRUE(SameFolders(folder, "whole", "killed")) << testing::ReadText(folder / ".diff");
}

TEST_F(FitBatch, NamesTheLineThatDoesNotRead) {
  const std::pair<const char*, const char*> kFaults[] = {
      {"demo_drink", "no object"},
      {"demo_drink mug hand=third", "third not in"},
      {"demo_drink mug start=x", "Value x"},
      {"demo_drink mug color=red", "unknown key"},
      {"demo_drink mug name=../out", "file or folder name"},
      {"demo_drink mug name=demo_drink_mug", "repeats"},
      {"\"demo_drink mug", "not closed"},
      {"demo_drink mug apple", "extra argument 'apple'"},
      {"demo_drink mug hnad=left", "hand"}};
  for (const auto& [line, said] : kFaults) {
    std::ofstream(folder / "list.txt") << "demo_drink mug\n" << line << "\n";
    const ProgramResult result = folder.Run("fit --batch list.txt -o out -q", 1);
    EXPECT_THAT(result.err, ::testing::AllOf(HasSubstr("list.txt:2"), HasSubstr(said))) << line;
    EXPECT_FALSE(std::filesystem::exists(folder / "out")) << line;
  }
}

TEST_F(Batch, AListGrowsAndIsSharedOut) {
  std::ofstream(folder / "list.txt") << "demo_drink name=\"größe 1\" end=2\n";
  const std::string batch = "export --batch list.txt -o out ";
  folder.Run(batch);
  EXPECT_TRUE(std::filesystem::exists(folder / "out" / "größe 1.glb"));
  std::ofstream(folder / "list.txt", std::ios::app)
      << "demo_pass name=b.bvh end=3\ndemo_pass name=c end=2 no-object=true\n";
  const nlohmann::json first = folder.Json(batch + "--shard 1/2");
  EXPECT_EQ(first["done_before"], 1);
  EXPECT_EQ(first["unfinished"], 1);
  EXPECT_EQ(folder.Json(batch + "--shard 2/2")["unfinished"], 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "out" / "b.bvh"));
  EXPECT_TRUE(std::filesystem::exists(folder / "out" / "c.glb"));
  const nlohmann::json manifest = folder.ReadJson("out/manifest.json");
  EXPECT_EQ(manifest["jobs"][1]["name"], "b.bvh");
  EXPECT_EQ(manifest["failed"], 0);
  // An option of all jobs is part of what each asks.
  folder.Fails(batch + "--start 1", 1, "another list, options");
  folder.Run("fit --batch list.txt -o out", 1);
}

TEST_F(Batch, SaysWhatIsWrongWithACommandLine) {
  std::ofstream(folder / "list.txt") << "demo_drink mug\n";
  for (const char* shard : {"0/4", "5/4", "1", "a/b", "1/2/3", "-1/4", "1/0"}) {
    folder.Fails(std::string("fit --batch list.txt -o out --shard ") + shard, 2, "K from 1 to N");
  }
  folder.Fails("fit demo_drink mug --batch list.txt -o out", 2, "--batch");
  folder.Fails("fit --batch list.txt", 2, "--output");
  folder.Fails("fit demo_drink mug -o out --shard 1/2", 2, "--batch");
  folder.Run("fit --batch missing.txt -o out", 1);
}

TEST_F(Batch, AFullDiskEndsTheRunAndNotItsResults) {
  std::ofstream list(folder / "list.txt");
  for (int k = 0; k < 8; ++k) list << "demo_drink end=2 name=" << k << ".bvh\n";
  list.close();
  EXPECT_THAT(
      folder.Run("export --batch list.txt -o out --threads 1", 1, "trap '' XFSZ; ulimit -f 1;").err,
      HasSubstr("could not be written"));
  EXPECT_THAT(folder.Run("export --batch list.txt -o out --retry-failed").out,
              HasSubstr("8 jobs, 0 failed"));
}

TEST_F(OffhandCommand, PassesTheAppleOfTheDemo) {
  const nlohmann::json metrics = folder.Json("offhand demo_pass apple -o out -q --no-report");
  ASSERT_EQ(metrics["switches"].size(), 1u);
  // The hand that takes over touches the apple; nothing else does.
  EXPECT_EQ(metrics["grasp"]["frames_through_body_ratio"], 0.0);
  EXPECT_NEAR(metrics["switches"][0]["frame"].get<int>(), 57, 2);
  EXPECT_EQ(metrics["switches"][0]["from"], "right");
  EXPECT_TRUE(metrics["switches"][0]["grasp"]["clean"].get<bool>());
  EXPECT_EQ(metrics["summary"]["frames_in_contact_ratio"], 1.0);
  // Whoever holds, holds cleanly. The hand that opens, and the one about to close, still pass
  // through the apple in the few frames next to the hand-over.
  const nlohmann::json all = folder.ReadJson("out/metrics.json");
  const nlohmann::json& depth = all["per_frame"]["penetration_depth_mm"];
  const int begin = metrics["switches"][0]["both_hold_from_frame"].get<int>();
  const int end = metrics["switches"][0]["both_hold_to_frame"].get<int>();
  for (int t = 0; t < static_cast<int>(depth.size()); ++t) {
    const bool beside = (t >= begin - 3 && t < begin) || (t >= end && t < end + 5);
    if (beside) continue;
    EXPECT_LT(depth[t].get<double>(), 2.0) << t;
  }
  const Clip clip = ReadClip(folder / "out" / "clip.npz");
  EXPECT_EQ(clip.holding_hand.front(), kHoldsRight);
  EXPECT_EQ(clip.holding_hand.back(), kHoldsLeft);
  EXPECT_EQ(clip.holding_hand[57], kHoldsRight | kHoldsLeft);
  // The object goes its way without a leap.
  for (int t = 1; t < clip.NumFrames(); ++t) {
    EXPECT_LT((clip.object->trans.col(t) - clip.object->trans.col(t - 1)).norm(), 0.06) << t;
  }
}

TEST_F(OffhandCommand, TellsWhoHoldsByTheLabels) {
  const ProgramResult result = folder.Run("offhand demo_pass apple --end 80 -o out -q --no-report");
  const std::vector<std::uint8_t> hands = ReadClip(folder / "out/clip.npz").holding_hand;
  const auto right = std::ranges::count(hands, kHoldsRight);
  const auto left = std::ranges::count(hands, kHoldsLeft);
  const auto both = std::ranges::count(hands, kHoldsRight | kHoldsLeft);
  EXPECT_GT(std::min({right, left, both}), 0);
  EXPECT_THAT(result.out,
              ::testing::HasSubstr(fmt::format("apple held by the right hand in {}, the left hand "
                                               "in {} and both hands in {} of 80 frames",
                                               right, left, both)));
  const nlohmann::json metrics = folder.ReadJson("out/metrics.json");
  EXPECT_EQ(metrics["held_by"], "the right and the left hand");
  EXPECT_EQ(metrics["frames_held"],
            (nlohmann::json{{"right", right}, {"left", left}, {"both", both}, {"none", 0}}));
}

TEST_F(FitCommand, HoldsABoxInBothHands) {
  const nlohmann::json metrics = folder.Json(
      "fit demo_pass cube --object-scale 3 --hand both --start 50 --end 70 -o out -q "
      "--no-report");
  EXPECT_EQ(metrics["held_by"], "both hands");
  EXPECT_EQ(metrics["summary"]["frames_in_contact_ratio"], 1.0);
  EXPECT_LT(metrics["summary"]["max_penetration_depth_mm"].get<double>(), 2.0);
  for (const std::uint8_t bits : ReadClip(folder / "out" / "clip.npz").holding_hand) {
    EXPECT_EQ(bits, kHoldsRight | kHoldsLeft);
  }
}

TEST_F(FitCommand, ThePapersTermsAreNothingElse) {
  folder.Run("fit demo_drink apple -o out --end 10 --paper --json -q --no-report");
  const nlohmann::json metrics = folder.ReadJson("out/metrics.json");
  EXPECT_EQ(metrics["options"]["lambda_penetration"], 0.0);
  EXPECT_EQ(metrics["options"]["lambda_limits"], 0.0);
  for (const auto& value : metrics["per_frame"]["energy_penetration_m2"]) EXPECT_EQ(value, 0.0);
}

}  // namespace
}  // namespace holdfast
