// SPDX-License-Identifier: MIT
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
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
using testing::Listing;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;
using testing::TemporaryFolder;

// A folder "captured" with walks about as fast as each other, and "rushed" with one that slides
// (legs too slow for its speed) and one that stands.
class NaturalnessCommand : public ::testing::Test {
 protected:
  NaturalnessCommand() {
    const BodyMeasures& body = DefaultMeasures();
    for (int i = 0; i < 4; ++i) {
      Write(testing::WalkingFigure(body, 150 + 10 * i, 0.95 + 0.03 * i),
            fmt::format("captured/person/walk_{}.npz", i));
    }
    Write(testing::WalkingFigure(body, 150, 2.4), "rushed/clip.npz");  // the best of the samples
    Write(testing::WalkingFigure(body, 150, 2.4), "rushed/samples/00.npz");
    Write(testing::WalkingFigure(body, 120, 2.5), "rushed/samples/01.npz");
    Write(testing::StandingFigure(body, 60), "rushed/samples/02.npz");
  }
  std::filesystem::path Path(const std::string& name) const { return folder_.Path() / name; }
  void Write(const Clip& clip, const std::string& name) const {
    std::filesystem::create_directories(Path(name).parent_path());
    WriteClip(clip, Path(name));
  }
  ProgramResult Evaluate(const std::string& arguments) const {
    return RunHoldfast(folder_.Path(), "evaluate naturalness " + arguments);
  }
  nlohmann::json Results(const std::string& folder) const {
    return nlohmann::json::parse(ReadText(Path(folder + "/results.json")));
  }
  static nlohmann::json Measure(const nlohmann::json& results, const std::string& key) {
    for (const nlohmann::json& measure : results["measures"]) {
      if (measure["key"] == key) return measure;
    }
    ADD_FAILURE() << "no " << key;
    return {};
  }

  TemporaryFolder folder_;
};

TEST_F(NaturalnessCommand, SetsSideBySide) {
  const ProgramResult result = Evaluate("captured --against ours=rushed -o out");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Listing(Path("out")), "motions.csv report.html results.json results.md ");
  EXPECT_THAT(result.out, HasSubstr("captured: 4 motions, 4 of them walks"));
  EXPECT_THAT(result.out, HasSubstr("ours: 3 motions, 2 of them walks"));
  EXPECT_THAT(result.out, HasSubstr("What sets ours apart: "));
  EXPECT_THAT(result.out, HasSubstr(ReadText(Path("out/results.md"))));

  const nlohmann::json results = Results("out");
  EXPECT_EQ(results["schema"], "holdfast/evaluate-naturalness/1");
  ASSERT_EQ(results["sets"].size(), 2u);
  EXPECT_EQ(results["sets"][1]["label"], "ours");
  const nlohmann::json speed = Measure(results, "speed_moving_m_s");
  EXPECT_NEAR(speed["sets"][0]["mean"].get<double>(), 0.995, 1e-3);
  EXPECT_NEAR(speed["sets"][1]["mean"].get<double>(), 2.45, 1e-3);
  EXPECT_EQ(speed["sets"][1]["motions"], 2);  // who stands is not asked
  EXPECT_GT(speed["sets"][1]["distance"].get<double>(), 10.0);
  EXPECT_NEAR(Measure(results, "speeding_ratio")["sets"][1]["mean"].get<double>(), 2.0 / 3.0, 1e-9);
  EXPECT_FALSE(results["sets"][1]["set_apart_by"].empty());
  EXPECT_EQ(results["curves"]["speed_profile"]["sets"][1]["motions"], 2);

  const std::string csv = ReadText(Path("out/motions.csv"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 4 + 3);
  EXPECT_THAT(csv, HasSubstr("\"captured\",\"person/walk_0\",150,"));
  const std::string page = ReadText(Path("out/report.html"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, ::testing::Not(HasSubstr("nan")));

  EXPECT_EQ(Evaluate("captured -o out").exit_code, 1);  // is there already
  const ProgramResult alone = Evaluate("captured -o out --force --json");
  ASSERT_EQ(alone.exit_code, 0) << alone.err;
  EXPECT_EQ(nlohmann::json::parse(alone.out)["sets"].size(), 1u);
}

TEST_F(NaturalnessCommand, HandsHaveMeasuresAndAMeanOfTheirOwn) {
  ASSERT_EQ(Evaluate("captured --against ours=rushed -q -o out").exit_code, 0);
  const ProgramResult result = Evaluate("captured --against ours=rushed -q --hands -o hands");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("| mean over the hand's |"));
  const nlohmann::json without = Results("out"), with = Results("hands");
  EXPECT_EQ(with["measures"].size(), without["measures"].size() + 6);
  EXPECT_EQ(Measure(with, "hand_peak_m_s")["sets"].size(), 2u);
  // What is asked of the whole body does not change.
  EXPECT_EQ(with["sets"][1]["mean_distance"], without["sets"][1]["mean_distance"]);
  EXPECT_EQ(with["sets"][1]["mean_distance_by_chance"],
            without["sets"][1]["mean_distance_by_chance"]);
  EXPECT_EQ(with["sets"][1]["oddest"], without["sets"][1]["oddest"]);
  EXPECT_TRUE(with["sets"][1].contains("hand_distance"));
  EXPECT_FALSE(without["sets"][1].contains("hand_distance"));
  EXPECT_TRUE(with["curves"].contains("hand_speed"));
  EXPECT_FALSE(without["curves"].contains("hand_speed"));
}

TEST_F(NaturalnessCommand, TheSameBytesOnAnyThreads) {
  const std::string what = "captured --against rushed --limits captured --quiet ";
  ASSERT_EQ(Evaluate(what + "--threads 1 -o a").exit_code, 0);
  ASSERT_EQ(Evaluate(what + "--threads 3 -o b").exit_code, 0);
  for (const std::string name : {"results.json", "results.md", "motions.csv", "report.html"}) {
    EXPECT_EQ(ReadText(Path("a/" + name)), ReadText(Path("b/" + name))) << name;
  }
  ASSERT_EQ(Evaluate(what + "--seed 7 -o c").exit_code, 0);
  EXPECT_NE(ReadText(Path("a/results.json")), ReadText(Path("c/results.json")));
}

TEST_F(NaturalnessCommand, ChoosesWhatIsCompared) {
  ASSERT_EQ(Evaluate("captured --against rushed --moving-only -o moving").exit_code, 0);
  EXPECT_EQ(Results("moving")["sets"][1]["motions"], 2);
  ASSERT_EQ(Evaluate("captured --against rushed --at-most 2 -o few").exit_code, 0);
  EXPECT_EQ(Results("few")["sets"][0]["motions"], 2);
  EXPECT_EQ(Results("few")["sets"][1]["label"], "rushed");
  // Two paths of one label are one set.
  ASSERT_EQ(Evaluate("captured --against a=rushed/samples/00.npz --against b=rushed "
                     "--against a=rushed/samples/01.npz -o both")
                .exit_code,
            0);
  EXPECT_EQ(Results("both")["sets"][1]["motions"], 2);
  EXPECT_EQ(Results("both")["sets"].size(), 3u);
}

TEST_F(NaturalnessCommand, SaysWhatIsWrong) {
  const auto fault = [&](const std::string& arguments, const std::string& words) {
    const ProgramResult result = Evaluate(arguments + " -o out");
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(Path("out"))) << arguments;
  };
  std::filesystem::create_directory(Path("empty"));
  std::ofstream(Path("captured/person/broken.npz")) << "no archive";
  fault("captured", "broken.npz");
  std::filesystem::remove(Path("captured/person/broken.npz"));
  fault("empty", "no clip");
  fault("captured --against nowhere", "nowhere");
  fault("captured --against ours=", "names no set");
  fault("captured --against captured", "name of the reference");
  fault("captured --against rushed/samples/02.npz --moving-only", "none of its 1 motions");
  EXPECT_EQ(Evaluate("-o out").exit_code, 2);
  EXPECT_EQ(Evaluate("captured").exit_code, 2);
  EXPECT_EQ(Evaluate("captured -o out --way -1").exit_code, 2);
  const ProgramResult help = Evaluate("--help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("--against made=reaches/made"));
}

}  // namespace
}  // namespace holdfast
