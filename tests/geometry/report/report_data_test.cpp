// SPDX-License-Identifier: MIT
#include "geometry/report/report_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/import/load_clip.h"

namespace holdfast {
namespace {

using ::testing::StartsWith;

TEST(ReportClip, HoldsTheMotionItsCurvesAndWhatIsMissing) {
  const LoadedClip motion = LoadClip("demo_drink");
  ReportInput input;
  input.source = "demo_drink";
  input.clip = Slice(motion.clip, 0, 4);
  input.body = motion.body.model;
  input.betas = motion.body.betas;
  input.object_missing = "no mesh";
  input.metrics = {{"per_frame", {{"cost", {4, 3, 2, 1}}, {"short", {1, 2}}}}};
  const ReportClip report = MakeReportClip(input);
  EXPECT_EQ(ReportName(input), "demo_drink");
  EXPECT_LT(report.surface_error_mm, 0.11);
  const nlohmann::json& header = report.header;
  EXPECT_EQ(header["frames"], 4);
  EXPECT_EQ(header["notes"][0], "The object is not shown: no mesh");
  EXPECT_EQ(header["series"]["cost"], nlohmann::json({4, 3, 2, 1}));
  EXPECT_FALSE(header["series"].contains("short")) << "a value for each frame, or no curve";
  EXPECT_EQ(header["series"]["right_wrist_height_m"].size(), 4u);
  EXPECT_FALSE(header["metrics"].contains("per_frame"));
  EXPECT_EQ(header["arrays"]["rest"]["count"], 3 * header["vertices"].get<int>());
  EXPECT_THAT(report.payload.Encode(), StartsWith("eJ")) << "zlib's head in base64";
  EXPECT_EQ(header["has_marker"], false);

  input.metrics["goals"] = {{{"goal_m", {1.0, 2.0, 3.0}}}, {{"goal_m", {0.0, 0.0, 1.0}}}};
  const nlohmann::json marked = MakeReportClip(input).header;
  EXPECT_EQ(marked["has_marker"], true);
  EXPECT_TRUE(marked["arrays"].contains("marker_faces"));
}

TEST(ReportClip, FindsTheGoalsOfAReachATrackAndATake) {
  EXPECT_EQ(GoalsIn(nullptr).size(), 0);
  EXPECT_EQ(GoalsIn({{"seed", 1}}).size(), 0);
  const nlohmann::json reach = {{"goals", {{{"goal_m", {1, 2, 3}}}, {{"goal_m", {4, 5, 6}}}}}};
  EXPECT_EQ(GoalsIn(reach), (Eigen::VectorXd(6) << 1, 2, 3, 4, 5, 6).finished());
  const nlohmann::json track = {{"per_frame", {{"goal_m", {{1, 2, 3}, {4, 5, 6}}}}}};
  EXPECT_EQ(GoalsIn(track), (Eigen::MatrixXd(3, 2) << 1, 4, 2, 5, 3, 6).finished());
  const nlohmann::json take = {{"options", {{"places_m", {{1, 2, 3}, {4, 5, 6}}}}}};
  EXPECT_EQ(GoalsIn(take), Eigen::Vector3d(4, 5, 6));
  EXPECT_THROW(GoalsIn({{"goals", {{{"goal_m", "here"}}}}}), Error);
}

}  // namespace
}  // namespace holdfast
