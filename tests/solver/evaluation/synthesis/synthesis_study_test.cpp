// SPDX-License-Identifier: MIT
#include "solver/evaluation/synthesis/synthesis_study.h"

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/container/safetensors.h"
#include "tests/support/action_scene.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

ClipScene ComposedScene(int which) {
  ClipScene scene;
  scene.clip = imos::testing::ComposedActionClip(which, which, "s10");
  scene.body = BodyModel::Default();
  scene.betas = Eigen::VectorXd::Zero(10);
  scene.object_source = scene.clip.object->name;
  return scene;
}

std::vector<SynthesisCase> ComposedCases(int count) {
  std::vector<SynthesisCase> cases;
  for (int k = 0; k < count; ++k) {
    cases.push_back(SynthesisCaseOf(imos::testing::ComposedSequence(k, k, "s10"), ComposedScene(k),
                                    imos::KeyFrameRule::kWhole)
                        .value());
  }
  return cases;
}

// A network that nobody trained and a recognizer that knows nothing.
class SynthesisStudyTest : public ::testing::Test {
 protected:
  SynthesisStudyTest() {
    SynthesisNetwork network;
    network.source = "drawn";
    network.weights = imos::RandomNetwork(imos::CompactConfig(), 3);
    network.checksum = "3";
    network.action_table = imos::ActionTable(network.weights);
    networks_.emplace_back("full", network);
    rows_ = SynthesisRows(networks_, std::array{ObjectMode::kGiven, ObjectMode::kCarried});
    options_.repeats = 2;
    options_.object_cases = 1;
  }
  SynthesisStudy Study(
      const std::string& folder, std::function<bool()> stopped = [] { return false; }) const {
    return SynthesisStudy(folder_ / folder, cases_, recognizer_, "1", options_, std::move(stopped));
  }

  testing::TemporaryFolder folder_;
  std::vector<SynthesisCase> cases_ = ComposedCases(4);
  imos::Recognizer recognizer_{imos::RandomRecognizer(1)};
  std::vector<RatedNetwork> networks_;
  std::vector<SynthesisRow> rows_;
  SynthesisStudyOptions options_;
};

TEST_F(SynthesisStudyTest, GivesTheSameForAnyNumberOfThreadsAndGoesOnWhereItWas) {
  std::vector<int> made;
  SynthesisStudy first = Study("a");
  EXPECT_EQ(first.Count(rows_).left, 4 * (3 + 2 * 2));
  const std::vector<SynthesisResult> results =
      first.Run(rows_, [&](int done) { made.push_back(done); });
  ASSERT_THAT(results, SizeIs(5));  // real, clip, still, the network twice
  EXPECT_THAT(made, ElementsAre(4, 8, 12, 16, 20, 24, 28));
  EXPECT_FALSE(results[0].summary.mpjpe_m);
  EXPECT_GT(results[3].summary.mpjpe_m->mean, results[2].summary.mpjpe_m->mean);  // untrained
  EXPECT_EQ(results[3].summary.mpjpe_m->repeats, 2);
  // The clips themselves were composed with the object fixed to the wrist.
  EXPECT_NEAR(results[1].summary.objects.at("jitter_acceleration_ratio").value(), 1.0, 0.02);

  options_.threads = 3;
  const std::vector<SynthesisResult> again = Study("b").Run(rows_);
  options_.threads = 1;
  fs::remove(folder_ / "a/blocks/carried_full_01_0000.safetensors");
  SynthesisStudy later = Study("a");
  EXPECT_EQ(later.Count(rows_).left, 4);
  const std::vector<SynthesisResult> continued = later.Run(rows_);
  for (std::size_t r = 0; r < results.size(); ++r) {
    for (const auto* other : {&again[r], &continued[r]}) {
      EXPECT_EQ(other->summary.objects, results[r].summary.objects);
      EXPECT_EQ(other->summary.accuracy.mean, results[r].summary.accuracy.mean);
      EXPECT_EQ(other->summary.fid_code.has_value(), results[r].summary.fid_code.has_value());
      if (!results[r].summary.mpjpe_m) continue;
      EXPECT_EQ(other->summary.mpjpe_m->mean, results[r].summary.mpjpe_m->mean);
    }
  }
}

TEST_F(SynthesisStudyTest, KeepsCompleteBlocksWhenItIsStopped) {
  bool stop = false;
  SynthesisStudy study = Study("a", [&] { return stop; });
  EXPECT_THAT(study.Run(rows_, [&](int done) { stop = done >= 8; }), IsEmpty());
  EXPECT_EQ(study.Count(rows_).left, 4 * (3 + 2 * 2) - 8);
}

TEST_F(SynthesisStudyTest, DoesNotMixInBlocksOfAnotherQuestionOrDamagedOnes) {
  const auto error = [&] {
    try {
      Study("a").Run(rows_);
    } catch (const Error& fault) {
      return std::string(fault.what());
    }
    return std::string();
  };
  Study("a").Run(rows_);
  options_.seed = 2;
  EXPECT_THAT(error(), HasSubstr("holds results of a different configuration (networks, "
                                 "action classifier, clips or seed)"));
  options_.force = true;
  EXPECT_EQ(error(), "");

  const fs::path block = folder_ / "a/blocks/given_full_00_0000.safetensors";
  SafetensorsWriter writer;
  writer.AddFloat32("features", {1}, std::array{1.0f});
  writer.SetMetadata(SafetensorsReader(block).Metadata());
  writer.Write(block);
  EXPECT_THAT(error(), HasSubstr("is damaged"));
}

TEST(SynthesisCase, NeedsTheObjectInAHandWhereTheNetworksGoOn) {
  ClipScene scene = ComposedScene(0);
  scene.clip.holding_hand.assign(scene.clip.NumFrames(), 0);
  EXPECT_FALSE(
      SynthesisCaseOf(imos::testing::ComposedSequence(0, 0), scene, imos::KeyFrameRule::kWhole));
}

SynthesisResult Measured(const std::string& key, double mpjpe_m, double accuracy) {
  SynthesisResult result;
  result.row = {key, LabelOfNetwork(key), RowKind::kNetwork, ObjectMode::kGiven};
  result.summary.mpjpe_m = imos::RepeatedValue{mpjpe_m, 0.001, 20};
  result.summary.accuracy = {accuracy, 0.01, 20};
  return result;
}

TEST(SynthesisResults, MeansOverSeedsStandForTheirNetworksInTheOrder) {
  std::vector<SynthesisResult> results = {Measured("full", 0.04, 0.8),
                                          Measured("full@2", 0.06, 0.9),
                                          Measured("no-attention", 0.2, 0.855)};
  AddMeansOverSeeds(results);
  ASSERT_THAT(results, SizeIs(4));
  const SynthesisResult& mean = results[3];
  EXPECT_EQ(mean.row.label, "full model, mean of 2 seeds");
  EXPECT_DOUBLE_EQ(mean.summary.mpjpe_m->mean, 0.05);
  // 1.96 s / sqrt(2), s = |a - b| / sqrt(2).
  EXPECT_NEAR(mean.summary.mpjpe_m->interval, 0.98 * 0.02, 1e-12);
  EXPECT_THAT(OrderOfRows(results, ObjectMode::kGiven),
              ElementsAre("MPJPE: the full model is ahead of every ablation",
                          "accuracy: even with ablation 2: no self-attention"));
  EXPECT_THAT(OrderOfRows(results, ObjectMode::kFitted), IsEmpty());
}

}  // namespace
}  // namespace holdfast
