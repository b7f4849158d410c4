// SPDX-License-Identifier: MIT
// A held mug over to other mugs, sizes and people, by the program.
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;
using testing::TemporaryFolder;

// Ten frames of the demo with a held mug, made once.
const TemporaryFolder& Held() {
  static const TemporaryFolder folder;
  static const bool made =
      RunHoldfast(folder.Path(), "fit demo_drink mug --end 10 -o held --quiet --no-report")
          .exit_code == 0;
  EXPECT_TRUE(made);
  return folder;
}

ProgramResult Transfer(const std::string& arguments) {
  return RunHoldfast(Held().Path(), "transfer held --no-report " + arguments);
}

nlohmann::json Metrics(const char* folder) {
  return nlohmann::json::parse(ReadText(Held() / folder / "metrics.json"));
}

void ExpectClean(const char* folder) {
  const nlohmann::json metrics = Metrics(folder);
  EXPECT_EQ(metrics["summary"]["frames_deeper_than_2_mm"], 0);
  EXPECT_EQ(metrics["summary"]["frames_in_contact_ratio"], 1.0);
  EXPECT_TRUE(metrics["holds"][0]["clean"]);
  EXPECT_FALSE(metrics["holds"][0]["searched"]);
}

TEST(Transfer, KeepsContactsOfAMugThatIsLargerOrSmaller) {
  for (const char* scale : {"0.8", "1.3", "1,1,1.3"}) {
    ASSERT_EQ(Transfer("--scale " + std::string(scale) + " -o scaled -f -q").exit_code, 0);
    ExpectClean("scaled");
    EXPECT_EQ(Metrics("scaled")["following"]["kept"], "wrists");
  }
}

TEST(Transfer, GoesToAnotherMugByShape) {
  ASSERT_EQ(Transfer("--scale 1.1,0.9,1.2 -o other -f -q").exit_code, 0);
  ASSERT_EQ(Transfer("--object other/object.ply -o to_other -f -q").exit_code, 0);
  ExpectClean("to_other");
  const nlohmann::json map = Metrics("to_other")["map"];
  EXPECT_EQ(map["method"], "registered");
  EXPECT_TRUE(map["alike"]);
  EXPECT_LT(map["residual_mm"], 1.0);
}

TEST(Transfer, GivesTheObjectToAShorterPersonWhereItWas) {
  ASSERT_EQ(Transfer("--betas -2,1 -o short -f -q").exit_code, 0);
  ExpectClean("short");
  const Clip clip = ReadClip(Held() / "short/clip.npz"),
             source = ReadClip(Held() / "held/clip.npz");
  EXPECT_EQ(clip.betas.size(), 2);
  EXPECT_LT((clip.object->trans - source.object->trans).colwise().norm().maxCoeff(), 0.08);
  EXPECT_LT(Metrics("short")["following"]["ankle_missed_mm"], 5.0);
}

TEST(Transfer, SaysHowFarTheMapStretchesForAnotherKind) {
  const ProgramResult result = Transfer("--object hammer -o hammer -f");
  EXPECT_THAT(result.err, HasSubstr("hardly of mug's kind: the map stretches up to"));
}

TEST(Transfer, VariantsGoOnWhereTheyWereStoppedOnAnyNumberOfThreads) {
  ASSERT_EQ(Transfer("--variants 4 -o four -q --threads 2").exit_code, 0);
  ASSERT_EQ(Transfer("--variants 2 -o more -q --threads 1").exit_code, 0);
  const std::string two = ReadText(Held() / "more/manifest.jsonl");
  ASSERT_EQ(Transfer("--variants 4 -o more -q --threads 1").exit_code, 0);
  const std::string four = ReadText(Held() / "more/manifest.jsonl");
  EXPECT_EQ(four.substr(0, two.size()), two);
  EXPECT_EQ(four, ReadText(Held() / "four/manifest.jsonl"));
  EXPECT_EQ(testing::Listing(Held() / "more"), testing::Listing(Held() / "four"));
  std::istringstream lines(four);
  int kept = 0;
  for (std::string text; std::getline(lines, text);) {
    const nlohmann::json line = nlohmann::json::parse(text);
    if (!line.value("kept", false)) continue;
    ++kept;
    EXPECT_LE(line["deepest_mm"], 2.0);
    EXPECT_EQ(line["in_contact_ratio"], 1.0);
    const std::string file = line["file"];
    EXPECT_EQ(ReadText(Held() / "more" / file), ReadText(Held() / "four" / file)) << file;
  }
  EXPECT_EQ(kept, 4);
  EXPECT_THAT(Transfer("--variants 4 -o more -q --seed 9").err, HasSubstr("another clip, options"));
}

TEST(Transfer, RefusesWhatIsNone) {
  const auto refused = [](const std::string& arguments, int exit_code, const char* why) {
    const ProgramResult result = Transfer(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << arguments << '\n' << result.err;
    EXPECT_THAT(result.err, HasSubstr(why)) << arguments;
  };
  refused("-o x", 2, "Say to what");
  refused("--scale 0 -o x", 2, "--scale");
  refused("--scale -1 -o x", 2, "--scale");
  refused("--scale nan -o x", 2, "--scale");
  refused("--scale 1,2 -o x", 1, "two factors");
  refused("--scale 1e9 -o x", 2, "--scale");
  refused("--scale 15 -o x", 3, "no hand touches");
  refused("--object none.obj -o x", 1, "none.obj");
  refused("--object mug --object-scale 1000 -o x", 1, "mug");
  refused("--object mug --map none.txt -o x", 1, "none.txt");
  refused("--betas 1e9 -o x", 1, "--betas");
  std::ofstream(Held() / "map.txt") << "1\n2\n";
  refused("--object mug --map map.txt -o x", 1, "has 2 rows");
  const ProgramResult bare = RunHoldfast(Held().Path(), "transfer demo_drink --scale 1.1 -o x");
  EXPECT_EQ(bare.exit_code, 1);
  EXPECT_THAT(bare.err, HasSubstr("has no object"));
  EXPECT_FALSE(std::filesystem::exists(Held() / "x"));
}

}  // namespace
}  // namespace holdfast
