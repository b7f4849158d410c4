// SPDX-License-Identifier: MIT
#include "geometry/report/report_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
}

}  // namespace
}  // namespace holdfast
