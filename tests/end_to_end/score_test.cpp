// SPDX-License-Identifier: MIT
// Scores through the program: of a fit, against references, and of what cannot be scored.
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/support/program.h"

namespace holdfast {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::ReadText;

class Score : public testing::ProgramTest {
 protected:
  // A fit of ten frames in `held`.
  void Fit(const std::string& object = "cylinder") const {
    folder.Run("fit demo_drink " + object + " -q -o held --end 10");
  }
  json Scores(const std::string& arguments) const {
    const ProgramResult result = folder.Run("score -q --json " + arguments);
    EXPECT_EQ(result.err, "");
    return json::parse(result.out);
  }
};

TEST_F(Score, OfAFitIsCompleteAndSaysHowItWasMeasured) {
  Fit();
  const json scores = Scores("held --per-frame");
  const json& clip = scores["clips"][0];
  EXPECT_EQ(clip["foreign_body"], false);  // fitted with the body that is loaded
  EXPECT_EQ(clip["protocol"]["inside_by"], "pseudonormal");
  EXPECT_EQ(clip["protocol"]["hands_by"], "holding_hand");
  const json& values = clip["values"];
  EXPECT_EQ(values["contact_frames_ratio"], 1.0);
  EXPECT_EQ(values["exact_volume_frames_ratio"], 1.0);
  EXPECT_LT(values["contact_drift_max_mm"].get<double>(), 2.0);
  EXPECT_NEAR(values["jitter_acceleration_ratio"].get<double>(), 1.0, 0.1);
  EXPECT_TRUE(values["mpjpe_mm"].is_null());
  for (const auto& [key, value] : values.items()) {
    EXPECT_FALSE(scores["protocol"]["metrics"][key]["definition"].get<std::string>().empty())
        << key;
  }
  const json& frames = clip["hands"][0]["per_frame"];
  for (const auto& [key, series] : frames.items()) EXPECT_EQ(series.size(), 10u) << key;
  // The summary is of these frames.
  double deepest = 0.0;
  for (std::size_t t = 0; t < 10; ++t) {
    deepest = std::max({deepest, frames["hand_in_object_mm"][t].get<double>(),
                        frames["object_in_hand_mm"][t].get<double>()});
  }
  EXPECT_EQ(values["penetration_max_mm"].get<double>(), deepest);
}

TEST_F(Score, AgreesWithTheFitsOwnMetrics) {
  Fit("mug");
  const json fit = folder.ReadJson("held/metrics.json")["summary"];
  const json values = Scores("held")["clips"][0]["values"];
  const auto same = [](const json& a, const char* key, const json& b, const char* b_key) {
    EXPECT_NEAR(a[key].get<double>(), b[b_key].get<double>(), 1e-5) << key;
  };
  same(values, "contact_ratio", fit, "contact_ratio");
  same(values, "contact_frames_ratio", fit, "frames_in_contact_ratio");
  same(values, "intersection_volume_voxel_cm3", fit, "mean_intersection_volume_cm3");
  same(values, "penetration_max_mm", fit, "max_penetration_depth_mm");
  same(values, "penetration_mean_max_mm", fit, "mean_max_penetration_depth_mm");
  same(values, "penetration_mean_mm", fit, "mean_penetration_depth_mm");
  same(values, "object_in_hand_max_mm", fit, "object_in_hand_max_mm");
  // The rim of the mug is in the hand where no vertex of the hand is in the rim.
  EXPECT_GT(values["object_in_hand_max_mm"].get<double>(), 0.0);

  // With noise, who holds found, half of the frames nobody's; refined, and scored again.
  Clip noisy = ReadClip(folder / "held/clip.npz");
  for (int t = 0; t < noisy.NumFrames(); ++t) noisy.object->trans(2, t) += t % 2 == 0 ? 0.004 : 0.0;
  for (std::size_t t = 0; t < 4; ++t) noisy.holding_hand[t] = 0;
  WriteClip(noisy, folder / "held/clip.npz");
  const ProgramResult run = folder.Run("refine held/clip.npz --hand clip -o clean -q --json");
  for (const char* when : {"before", "after"}) {
    const json refined = json::parse(run.out)[when];
    const json score =
        Scores(std::string(when) == "before" ? "held" : "clean")["clips"][0]["values"];
    same(score, "penetration_max_mm", refined, "max_penetration_depth_mm");
    same(score, "penetration_mean_max_mm", refined, "mean_max_penetration_depth_mm");
    same(score, "contact_frames_ratio", refined, "frames_in_contact_ratio");
    same(score, "intersection_volume_voxel_cm3", refined, "mean_intersection_volume_cm3");
    same(score, "object_acceleration_m_s2", refined, "object_acceleration_m_s2");
    same(score, "jitter_acceleration_ratio", refined, "object_acceleration_against_hand");
  }
}

TEST_F(Score, AgainstAShiftedReferenceGivesTheShift) {
  Fit();
  Clip clip = ReadClip(folder / "held/clip.npz");
  clip.trans.row(0).array() += 0.010;
  clip.object->trans.row(0).array() += 0.010;
  clip.object->trans.row(1).array() += 0.020;
  WriteClip(clip, folder / "held/reference.npz");
  const json scores = Scores("held -r held/reference.npz");
  const json& values = scores["clips"][0]["values"];
  EXPECT_NEAR(values["mpjpe_mm"].get<double>(), 10.0, 1e-6);
  EXPECT_NEAR(values["mpjpe_root_aligned_mm"].get<double>(), 0.0, 1e-6);
  EXPECT_NEAR(values["object_add_mm"].get<double>(), std::sqrt(500.0), 1e-6);
  EXPECT_NEAR(values["object_translation_error_mm"].get<double>(), std::sqrt(500.0), 1e-6);
  EXPECT_LE(values["object_add_s_mm"].get<double>(), values["object_add_mm"].get<double>());
  EXPECT_THAT(scores["clips"][0]["reference"]["object_symmetry"]["found"].get<std::string>(),
              HasSubstr("any turn about"));
}

TEST_F(Score, SeveralClipsNameTheWorst) {
  Fit();
  std::filesystem::copy(folder / "held", folder / "pushed");
  Clip pushed = ReadClip(folder / "pushed/clip.npz");
  // Towards the wrist, into the hand.
  pushed.object->trans.row(2).array() += 0.004;
  pushed.object->trans.row(1).array() += 0.01;
  WriteClip(pushed, folder / "pushed/clip.npz");
  const json scores = Scores("held pushed held");
  const json& deepest = scores["summary"]["penetration_max_mm"];
  EXPECT_EQ(deepest["clips"], 3);
  const double a = scores["clips"][0]["values"]["penetration_max_mm"].get<double>();
  const double b = scores["clips"][1]["values"]["penetration_max_mm"].get<double>();
  EXPECT_EQ(deepest["worst_clip"], b > a ? "pushed" : "held");
  EXPECT_EQ(deepest["median"], a);
  EXPECT_NEAR(deepest["mean"].get<double>(), (2 * a + b) / 3, 1e-12);
  const ProgramResult table = folder.Run("score held pushed -q --csv table.csv");
  EXPECT_THAT(table.out, HasSubstr("median"));
  EXPECT_THAT(table.out, HasSubstr("frames deeper than 2 mm"));
  EXPECT_THAT(ReadText(folder / "table.csv"), HasSubstr("\n(worst),"));
}

TEST_F(Score, WhatAShellNamesBesideResultsIsLeftOut) {
  std::ofstream(folder / "list.txt") << "demo_drink cylinder end=3\n";
  folder.Run("fit --batch list.txt -o fits -q");
  ASSERT_EQ(Scores("fits/* --csv fits/table.csv")["clips"].size(), 1u);
  EXPECT_THAT(folder.Run("score fits/*").err,
              HasSubstr("not a clip, ignored: fits/manifest.json, fits/table.csv"));

  std::ofstream(folder / "fits/mine.json") << R"({"trans": "none"})";
  folder.Fails("score fits/*", 1, "fits/mine.json");
  folder.Run("score fits/manifest.json", 1);
}

TEST_F(Score, WithoutAnObjectMotionIsMeasured) {
  const json clip = Scores("demo_drink")["clips"][0];
  EXPECT_TRUE(clip["values"]["penetration_max_mm"].is_null());
  EXPECT_TRUE(clip["values"]["foot_skate_mm_per_frame"].is_number());
  EXPECT_THAT(clip["notes"][0].get<std::string>(), HasSubstr("no object"));
}

TEST_F(Score, AMeshWithHolesIsMeasuredByStatedFallbacks) {
  Fit();
  TriangleMesh mesh = ReadMesh(folder / "held/object.ply");
  mesh.faces.conservativeResize(3, mesh.NumFaces() - 3);
  WriteMesh(mesh, folder / "open.ply");
  const json scores = Scores("held --object open.ply");
  const json& clip = scores["clips"][0];
  EXPECT_EQ(clip["protocol"]["inside_by"], "winding number");
  EXPECT_EQ(clip["values"]["exact_volume_frames_ratio"], 0.0);
  EXPECT_EQ(clip["values"]["intersection_volume_cm3"],
            clip["values"]["intersection_volume_voxel_cm3"]);
  EXPECT_THAT(clip["notes"].dump(), HasSubstr("not watertight"));
  EXPECT_THAT(clip["notes"].dump(), HasSubstr("these frames use voxels of 2 mm"));
  folder.Fails("score held --object open.ply --exact on", 1, "not watertight");
}

TEST_F(Score, AnotherBodyThanTheClipsIsFlagged) {
  Fit();
  Clip clip = ReadClip(folder / "held/clip.npz");
  clip.body_model = "SMPLX_FEMALE";
  WriteClip(clip, folder / "held/foreign.npz");
  const json scores = Scores("held/foreign.npz");
  EXPECT_EQ(scores["clips"][0]["foreign_body"], true);
  EXPECT_THAT(scores["clips"][0]["notes"].dump(), HasSubstr("SMPLX_FEMALE"));
  EXPECT_EQ(scores["protocol"]["metrics"]["contact_ratio"]["depends_on_hand_surface"], true);
  EXPECT_THAT(folder.Run("score held/foreign.npz -q").out, HasSubstr("foreign*"));
}

TEST_F(Score, RefusesWhatCannotBeCompared) {
  Fit();
  Clip clip = ReadClip(folder / "held/clip.npz");
  WriteClip(Slice(clip, 0, 6), folder / "held/short.npz");
  const ProgramResult lengths = folder.Run("score held -r held/short.npz", 1);
  EXPECT_THAT(lengths.err, HasSubstr("has 10 frames"));
  EXPECT_THAT(lengths.err, HasSubstr("--overlap"));
  const json overlap = Scores("held -r held/short.npz --overlap");
  EXPECT_EQ(overlap["clips"][0]["reference"]["frames_compared"], 6);
  EXPECT_NEAR(overlap["clips"][0]["values"]["mpjpe_mm"].get<double>(), 0.0, 1e-9);

  clip.frame_rate = 60.0;
  WriteClip(clip, folder / "held/fast.npz");
  const ProgramResult rates = folder.Run("score held -r held/fast.npz", 1);
  EXPECT_THAT(rates.err, HasSubstr("30 Hz"));
  EXPECT_THAT(rates.err, HasSubstr("60 Hz"));
  EXPECT_THAT(Scores("held -r held/fast.npz --resample --overlap")["clips"][0]["notes"].dump(),
              HasSubstr("resampled from 60 to 30 Hz"));

  folder.Fails("score held -r held held", 1, "one reference for all");
  folder.Run("score held --exact maybe", 2);
  folder.Run("score", 2);
  folder.Run("score nowhere.npz", 1);
  folder.Run("score held -q --voxel 0 --exact off", 1);
  std::ofstream(folder / "there.json") << "kept";
  folder.Run("score held -q -o there.json", 1);
  EXPECT_EQ(ReadText(folder / "there.json"), "kept");
}

}  // namespace
}  // namespace holdfast
