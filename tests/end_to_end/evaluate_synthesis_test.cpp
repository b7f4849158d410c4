// SPDX-License-Identifier: MIT
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/imos/recognition.h"
#include "generator/imos/weights.h"
#include "tests/support/action_scene.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;

// A set, networks that nobody trained and a recognizer that knows nothing.
class EvaluateSynthesis : public ::testing::Test {
 protected:
  void SetUp() override {
    imos::testing::WriteComposedSet(folder_.Path() / "set", 4, {"s1", "s2", "s10"});
    const imos::Config config = imos::CompactConfig();
    imos::WriteNetwork(imos::RandomNetwork(config, 3), folder_ / "full.safetensors");
    imos::Config plain = config;
    plain.self_attention = false;
    imos::WriteNetwork(imos::RandomNetwork(plain, 4), folder_ / "plain.safetensors");
    imos::WriteRecognizer(imos::RandomRecognizer(1), folder_ / "recognizer.safetensors");
  }
  ProgramResult Run(const std::string& more, const std::string& output = "out") {
    return RunHoldfast(folder_.Path(),
                       "evaluate synthesis --data set --recognizer recognizer.safetensors -o " +
                           output + " " + more);
  }
  json Results(const std::string& output = "out") {
    return json::parse(ReadText(folder_ / (output + "/results.json")));
  }
  testing::TemporaryFolder folder_;
};

constexpr const char* kTwo =
    "--weights full=full.safetensors --weights no-attention=plain.safetensors --objects "
    "given,carried --repeats 3 ";
constexpr const char* kOne = "--weights full=full.safetensors --objects carried --repeats 2 ";

TEST_F(EvaluateSynthesis, GivesBothTablesWithTheRealMotionFirst) {
  const ProgramResult run = Run(kTwo);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json results = Results();
  ASSERT_EQ(results["rows"].size(), 7u);  // real, clip, still, two networks twice
  EXPECT_EQ(results["sequences"].size(), 4u);
  const json& real = results["rows"][0];
  EXPECT_EQ(real["row"], "real");
  EXPECT_TRUE(real["as_published"]["mpjpe_m"].is_null());
  EXPECT_EQ(real["objects"].size(), 11u);
  const json& full = results["rows"][3];
  EXPECT_EQ(full["label"], "full model");
  EXPECT_EQ(full["as_published"]["mpjpe_m"]["repeats"], 3);
  EXPECT_GT(full["as_published"]["mpjpe_m"]["mean"].get<double>(), 0.0);
  const json times = json::parse(ReadText(folder_ / "out/timing.json"));
  EXPECT_GT(times["rows"][3]["seconds_median"].get<double>(), 0.0);
  // A network that knows the seed alone is farther off than one that holds still: it is untrained.
  const json& still = results["rows"][2];
  EXPECT_GT(full["as_published"]["mpjpe_m"]["mean"], still["as_published"]["mpjpe_m"]["mean"]);
  EXPECT_EQ(results["rows"][5]["objects_placed"], "carried");
  // The clips themselves were composed with the object fixed to the wrist.
  const json& clip = results["rows"][1];
  EXPECT_FALSE(clip.contains("as_published"));
  EXPECT_NEAR(clip["objects"]["jitter_acceleration_ratio"].get<double>(), 1.0, 0.02);
  EXPECT_NEAR(clip["objects"]["contact_slip_mm_per_frame"].get<double>(), 0.0, 0.01);

  const std::string table = ReadText(folder_ / "out/results.md");
  EXPECT_THAT(table, HasSubstr("| real motion | - | - | - |"));
  EXPECT_THAT(table, HasSubstr("| IMoS | 0.03 ± 0.005 | 3.82 ± 0.004 | 0.27 ± 0.002 |"));
  EXPECT_THAT(table, HasSubstr("## Order of the rows, objects given"));
  const std::string page = ReadText(folder_ / "out/report.html");
  EXPECT_THAT(page, HasSubstr("ablation 2: no self-attention"));
  EXPECT_EQ(page.find("<script"), std::string::npos);
}

TEST_F(EvaluateSynthesis, GivesTheSameForAnyNumberOfThreadsAndGoesOnWhereItWas) {
  ASSERT_EQ(Run(std::string(kOne) + "--threads 1", "one").exit_code, 0);
  ASSERT_EQ(Run(std::string(kOne) + "--threads 3", "three").exit_code, 0);
  EXPECT_EQ(Results("one"), Results("three"));

  // A block that is gone is made again, the others are read.
  const std::string before = ReadText(folder_ / "one/results.json");
  const fs::path lost = folder_ / "one/blocks/carried_full_01_0000.safetensors";
  ASSERT_TRUE(fs::remove(lost));
  const ProgramResult again = Run(std::string(kOne) + "--threads 2", "one");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("16 of 20 motions are there already"));
  EXPECT_EQ(ReadText(folder_ / "one/results.json"), before);
  EXPECT_TRUE(fs::exists(lost));

  // Blocks of another configuration are not mixed in.
  const ProgramResult other = Run(std::string(kOne) + "--seed 2", "one");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("holds results of a different configuration"));
  EXPECT_EQ(Run(std::string(kOne) + "--seed 2 --force", "one").exit_code, 0);
  EXPECT_NE(Results("one"), Results("three"));
}

TEST_F(EvaluateSynthesis, TakesTheMeanOverSeedsOfATraining) {
  imos::WriteNetwork(imos::RandomNetwork(imos::CompactConfig(), 5), folder_ / "again.safetensors");
  const ProgramResult run =
      Run("--weights full=full.safetensors --weights full@2=again.safetensors --weights "
          "no-attention=plain.safetensors --objects given --repeats 2 --object-cases 1");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json rows = Results()["rows"];
  ASSERT_EQ(rows.size(), 7u);  // real, clip, still, three networks, one mean
  EXPECT_EQ(rows[4]["label"], "full model, seed 2");
  const json& mean = rows[6];
  EXPECT_EQ(mean["row"], "full");
  EXPECT_TRUE(mean["mean_of_seeds"].get<bool>());
  const auto mpjpe = [](const json& row) { return row["as_defined"]["mpjpe_m"]; };
  const double one = mpjpe(rows[3])["mean"], other = mpjpe(rows[4])["mean"];
  ASSERT_NE(one, other);
  EXPECT_NEAR(mpjpe(mean)["mean"].get<double>(), 0.5 * (one + other), 1e-12);
  EXPECT_EQ(mpjpe(mean)["repeats"], 2);
  // 1.96 s / sqrt(2), s = |a - b| / sqrt(2).
  EXPECT_NEAR(mpjpe(mean)["interval_95"].get<double>(), 0.98 * std::abs(one - other), 1e-12);
  EXPECT_THAT(ReadText(folder_ / "out/results.md"), HasSubstr("| full model, mean of 2 seeds |"));
}

TEST_F(EvaluateSynthesis, RefusesWhatMakesNoSense) {
  const auto error_of = [&](const std::string& more) {
    const ProgramResult run = Run(more);
    EXPECT_EQ(run.exit_code, 1) << more;
    return run.err;
  };
  EXPECT_THAT(error_of("--weights full.safetensors"), HasSubstr("is not NAME=FILE"));
  EXPECT_THAT(error_of("--weights full@=full.safetensors"), HasSubstr("is not NAME=FILE"));
  EXPECT_THAT(error_of("--weights a/b=full.safetensors"), HasSubstr("is not NAME=FILE"));
  EXPECT_THAT(error_of("--weights real=full.safetensors"), HasSubstr("the name of another row"));
  EXPECT_THAT(error_of("--weights full=recognizer.safetensors"),
              HasSubstr("recognizer.safetensors"));
  EXPECT_THAT(error_of("--weights full=full.safetensors --held-out s7"),
              HasSubstr("no clip is of these subjects. Those of the data are s1, s10, s2"));
  EXPECT_EQ(Run("--weights full=full.safetensors --objects thrown").exit_code, 2);
}

#ifdef HOLDFAST_HAS_TRAINING
TEST_F(EvaluateSynthesis, TakesARecognizerThatWasTrained) {
  const ProgramResult trained =
      RunHoldfast(folder_.Path(), "train recognizer set -o known.safetensors --epochs 3 --json -q");
  ASSERT_EQ(trained.exit_code, 0) << trained.err;
  const json summary = json::parse(trained.out);
  EXPECT_EQ(summary["held out"]["sequences"], 4);
  const imos::RecognizerWeights weights = imos::ReadRecognizer(folder_ / "known.safetensors");
  EXPECT_EQ(weights.notes.at("held_out"), "s10");
  EXPECT_EQ(RunHoldfast(folder_.Path(), "train recognizer set -o known.safetensors").exit_code, 1);
}
#endif

}  // namespace
}  // namespace holdfast
