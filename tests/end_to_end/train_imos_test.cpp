// SPDX-License-Identifier: MIT
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/imos/weights.h"
#include "geometry/io/container/atomic_file.h"
#include "tests/support/action_scene.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;

#ifdef HOLDFAST_HAS_TRAINING

class TrainImos : public ::testing::Test {
 protected:
  void SetUp() override {
    imos::testing::WriteComposedSet(folder_.Path() / "set", 6, {"s1", "s2", "s3", "s10"});
  }
  ProgramResult Train(const std::string& arguments) const {
    return RunHoldfast(folder_.Path(), "train imos set --batch 8 --evaluate-every 2 " + arguments);
  }

  testing::TemporaryFolder folder_;
};

TEST_F(TrainImos, WritesWeightsThatTheEvaluationTakes) {
  const ProgramResult result = Train("--iterations 4 --mirror -o out --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json summary = json::parse(result.out);
  EXPECT_EQ(summary["schema"], "holdfast/train-imos/1");
  EXPECT_EQ(summary["iterations"], 4);
  EXPECT_EQ(summary["sequences"], json({{"train", 24}, {"validation", 6}, {"held_out", 6}}));
  EXPECT_THAT(ReadText(folder_ / "out/train.html"), HasSubstr("<svg"));
  const imos::NetworkWeights weights = imos::ReadNetwork(folder_ / "out/best_half.safetensors");
  EXPECT_EQ(weights.config, imos::CompactConfig());
  EXPECT_EQ(weights.notes.at("key_frames"), "whole");
  EXPECT_EQ(json::parse(weights.notes.at("seen")).size(), 3u) << "three actions are composed";
}

TEST_F(TrainImos, TrainsTheAblations) {
  ASSERT_EQ(Train("--iterations 2 --no-attention -o plain -q").exit_code, 0);
  EXPECT_FALSE(imos::ReadNetwork(folder_ / "plain/best.safetensors").config.self_attention);
  ASSERT_EQ(Train("--iterations 2 --one-module --random-embeddings -o one -q").exit_code, 0);
  const imos::Config one = imos::ReadNetwork(folder_ / "one/best.safetensors").config;
  EXPECT_EQ(one.modules, imos::Modules::kOne);
  EXPECT_EQ(one.action_embedding, imos::ActionEmbedding::kRandom);
}

TEST_F(TrainImos, GoesOnBitForBitAndRefusesOtherOptions) {
  ASSERT_EQ(Train("--iterations 4 -o whole -q").exit_code, 0);
  const std::string weights = ReadText(folder_ / "whole/latest.safetensors");
  // What was done is not done again, and what comes out is the same.
  const ProgramResult again = Train("--iterations 4 -o whole");
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("resuming after iteration 4"));
  EXPECT_EQ(ReadText(folder_ / "whole/latest.safetensors"), weights);
  ASSERT_EQ(Train("--iterations 4 -o other --threads 2 -q").exit_code, 0);
  EXPECT_EQ(ReadText(folder_ / "other/latest.safetensors"), weights);
  const ProgramResult other = Train("--iterations 4 --stance-noise 0.2 -o whole");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.err, HasSubstr("other options or data"));
}

// A published recipe is what the command line leaves open, not what it says.
TEST_F(TrainImos, WhatIsGivenGoesBeforeThePublishedRecipe) {
  const ProgramResult result =
      RunHoldfast(folder_.Path(),
                  "train recognizer set --paper --epochs 2 --held-out s10 -o r.safetensors --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(json::parse(result.out)["epochs"], 2);
  const ProgramResult other = RunHoldfast(folder_.Path(),
                                          "train recognizer set --paper --epochs 2 --held-out s10 "
                                          "-o o.safetensors --learning-rate 1e-2");
  ASSERT_EQ(other.exit_code, 0) << other.err;
  EXPECT_NE(ReadText(folder_ / "r.safetensors"), ReadText(folder_ / "o.safetensors"));
}

TEST_F(TrainImos, BadInputIsNamed) {
  const auto fails = [&](const std::string& arguments, int code, const std::string& message) {
    const ProgramResult result = RunHoldfast(folder_.Path(), "train imos " + arguments);
    EXPECT_EQ(result.exit_code, code) << arguments;
    EXPECT_THAT(result.err, HasSubstr(message)) << arguments;
  };
  fails("nowhere -o out", 1, "nowhere");
  fails("set -o out --held-out s1,s2,s3,s10", 1, "held out or for validation");
  fails("set -o out --batch 1", 2, "--batch");
  fails("set -o out --paper --critic 0.1", 2, "--paper excludes --critic");
  WriteAtomically(folder_ / "words.npz", "PK\x03\x04 not a zip");
  fails("set -o out --action-embeddings words.npz", 1, "words.npz");
  fails("set -o out --action-embeddings words.npz --random-embeddings", 2, "--random-embeddings");
  WriteAtomically(folder_ / "set/s2/broken.npz", "nothing");
  fails("set -o out --iterations 1", 1, "broken.npz");
}

#endif

}  // namespace
}  // namespace holdfast
