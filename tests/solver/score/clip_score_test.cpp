// SPDX-License-Identifier: MIT
#include "solver/score/clip_score.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "solver/score/score_output.h"
#include "tests/support/carried_scene.h"
#include "tests/support/error_text.h"

namespace holdfast {
namespace {

using testing::CarriedMug;
using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(ScoreClip, MeasuresWhoHoldsAndComparesWithAReference) {
  ClipScene scene = CarriedMug(6);
  ScoreOptions options;
  options.threads = 2;
  const ClipScore score = ScoreClip(scene, &scene, options);
  EXPECT_EQ(score.hands_by, "holding_hand");
  ASSERT_THAT(score.hands, SizeIs(1));
  EXPECT_EQ(score.hands[0].side, Side::kRight);
  const MetricValues values = ClipValues(score, options);
  EXPECT_EQ(values.at("contact_frames_ratio"), 1.0);
  EXPECT_LT(values.at("penetration_max_mm").value(), 2.0);
  ASSERT_TRUE(score.reference);
  EXPECT_EQ(score.reference->frames, 6);
  for (const auto& metric : MetricDefinitions(options)) EXPECT_TRUE(values.contains(metric.key));

  scene.clip.holding_hand.clear();
  EXPECT_EQ(ScoreClip(scene, nullptr, options).hands_by, "nearest");
}

TEST(ScoreOutput, HasARowAndAKeyForEveryMetric) {
  const ClipScore score = ScoreClip(CarriedMug(6), nullptr);
  const std::vector<ClipScore> scores = {score, score};
  const std::string csv = ScoreCsv(scores, {});
  EXPECT_THAT(csv, HasSubstr("\ncarried,6,right,0,"));
  EXPECT_THAT(csv, HasSubstr("\n(mean),,,,"));
  nlohmann::json json;
  AddScores(scores, {}, true, json);
  EXPECT_EQ(json["clips"][1]["hands"][0]["per_frame"]["in_contact"].size(), 6u);
  for (const auto& metric : MetricDefinitions({})) {
    EXPECT_THAT(csv, HasSubstr("," + metric.key));
    EXPECT_TRUE(json["protocol"]["metrics"].contains(metric.key));
  }
  EXPECT_THAT(ScoreTable(scores, {}), HasSubstr("in contact: within"));
}

TEST(ScoreClip, RefusesWhatCannotBeCompared) {
  const ClipScene scene = CarriedMug(6);
  ClipScene shorter = scene;
  shorter.clip = Slice(scene.clip, 0, 4);
  EXPECT_THAT(testing::ErrorText([&] { ScoreClip(scene, &shorter); }),
              HasSubstr("has 6 frames, its reference carried has 4"));
  ScoreOptions options;
  options.overlap = true;
  EXPECT_EQ(ScoreClip(scene, &shorter, options).reference->frames, 4);
}

TEST(ScoreClip, StopsWhenToldTo) {
  const ClipScore score =
      ScoreClip(CarriedMug(6), nullptr, {}, [](const char*, int, int) { return false; });
  EXPECT_THAT(score.notes, SizeIs(0));
}

}  // namespace
}  // namespace holdfast
