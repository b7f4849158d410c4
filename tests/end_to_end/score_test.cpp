// SPDX-License-Identifier: MIT
// Scores through the program: of a fit, against references, and of what cannot be scored.
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;
using testing::TemporaryFolder;

// A fit of `frames` frames in `held`.
void Fit(const TemporaryFolder& folder, const char* object = "cylinder", int frames = 10) {
  const ProgramResult fit =
      RunHoldfast(folder.Path(), "fit demo_drink " + std::string(object) + " -q -o held --end " +
                                     std::to_string(frames));
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
}

json Score(const TemporaryFolder& folder, const std::string& arguments) {
  const ProgramResult result = RunHoldfast(folder.Path(), "score -q --json " + arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  return result.exit_code == 0 ? json::parse(result.out) : json();
}

TEST(Score, OfAFitIsCompleteAndSaysHowItWasMeasured) {
  const TemporaryFolder folder;
  Fit(folder);
  const json scores = Score(folder, "held --per-frame");
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

TEST(Score, AgreesWithTheFitsOwnMetrics) {
  const TemporaryFolder folder;
  Fit(folder, "mug");
  const json fit = json::parse(ReadText(folder / "held/metrics.json"))["summary"];
  const json values = Score(folder, "held")["clips"][0]["values"];
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
  const ProgramResult run =
      RunHoldfast(folder.Path(), "refine held/clip.npz --hand clip -o clean -q --json");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const char* when : {"before", "after"}) {
    const json refined = json::parse(run.out)[when];
    const json score =
        Score(folder, std::string(when) == "before" ? "held" : "clean")["clips"][0]["values"];
    same(score, "penetration_max_mm", refined, "max_penetration_depth_mm");
    same(score, "penetration_mean_max_mm", refined, "mean_max_penetration_depth_mm");
    same(score, "contact_frames_ratio", refined, "frames_in_contact_ratio");
    same(score, "intersection_volume_voxel_cm3", refined, "mean_intersection_volume_cm3");
    same(score, "object_acceleration_m_s2", refined, "object_acceleration_m_s2");
    same(score, "jitter_acceleration_ratio", refined, "object_acceleration_against_hand");
  }
}

TEST(Score, TheSameBytesForOneThreadAndTwo) {
  const TemporaryFolder folder;
  Fit(folder);
  for (const char* n : {"1", "2"}) {
    const std::string t = n;
    const ProgramResult result =
        RunHoldfast(folder.Path(), "score held held -r held --per-frame -q --threads " + t +
                                       " -o " + t + ".json --csv " + t + ".csv");
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  EXPECT_EQ(ReadText(folder / "1.json"), ReadText(folder / "2.json"));
  EXPECT_EQ(ReadText(folder / "1.csv"), ReadText(folder / "2.csv"));
  EXPECT_THAT(ReadText(folder / "1.csv"), HasSubstr("\n(worst),"));
}

TEST(Score, AgainstAShiftedReferenceGivesTheShift) {
  const TemporaryFolder folder;
  Fit(folder);
  Clip clip = ReadClip(folder / "held/clip.npz");
  clip.trans.row(0).array() += 0.010;
  clip.object->trans.row(0).array() += 0.010;
  clip.object->trans.row(1).array() += 0.020;
  WriteClip(clip, folder / "held/reference.npz");
  const json scores = Score(folder, "held -r held/reference.npz");
  const json& values = scores["clips"][0]["values"];
  EXPECT_NEAR(values["mpjpe_mm"].get<double>(), 10.0, 1e-6);
  EXPECT_NEAR(values["mpjpe_root_aligned_mm"].get<double>(), 0.0, 1e-6);
  EXPECT_NEAR(values["object_add_mm"].get<double>(), std::sqrt(500.0), 1e-6);
  EXPECT_NEAR(values["object_translation_error_mm"].get<double>(), std::sqrt(500.0), 1e-6);
  EXPECT_LE(values["object_add_s_mm"].get<double>(), values["object_add_mm"].get<double>());
  EXPECT_THAT(scores["clips"][0]["reference"]["object_symmetry"]["found"].get<std::string>(),
              HasSubstr("any turn about"));
}

TEST(Score, SeveralClipsNameTheWorst) {
  const TemporaryFolder folder;
  Fit(folder);
  std::filesystem::copy(folder / "held", folder / "pushed");
  Clip pushed = ReadClip(folder / "pushed/clip.npz");
  // Towards the wrist, into the hand.
  pushed.object->trans.row(2).array() += 0.004;
  pushed.object->trans.row(1).array() += 0.01;
  WriteClip(pushed, folder / "pushed/clip.npz");
  const json scores = Score(folder, "held pushed held");
  const json& deepest = scores["summary"]["penetration_max_mm"];
  EXPECT_EQ(deepest["clips"], 3);
  const double a = scores["clips"][0]["values"]["penetration_max_mm"].get<double>();
  const double b = scores["clips"][1]["values"]["penetration_max_mm"].get<double>();
  EXPECT_EQ(deepest["worst_clip"], b > a ? "pushed" : "held");
  EXPECT_EQ(deepest["median"], a);
  EXPECT_NEAR(deepest["mean"].get<double>(), (2 * a + b) / 3, 1e-12);
  const ProgramResult table = RunHoldfast(folder.Path(), "score held pushed -q");
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_THAT(table.out, HasSubstr("median"));
  EXPECT_THAT(table.out, HasSubstr("frames deeper than 2 mm"));
}

TEST(Score, WhatAShellNamesBesideResultsIsLeftOut) {
  const TemporaryFolder folder;
  std::ofstream(folder / "list.txt") << "demo_drink cylinder end=3\n";
  ASSERT_EQ(RunHoldfast(folder.Path(), "fit --batch list.txt -o fits -q").exit_code, 0);
  ASSERT_EQ(Score(folder, "fits/* --csv fits/table.csv")["clips"].size(), 1u);
  const ProgramResult again = RunHoldfast(folder.Path(), "score fits/*");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("not a clip, ignored: fits/manifest.json, fits/table.csv"));

  std::ofstream(folder / "fits/mine.json") << R"({"trans": "none"})";
  const ProgramResult other = RunHoldfast(folder.Path(), "score fits/*");
  EXPECT_EQ(other.exit_code, 1) << "not what the program wrote";
  EXPECT_THAT(other.err, HasSubstr("fits/mine.json"));
  EXPECT_EQ(RunHoldfast(folder.Path(), "score fits/manifest.json").exit_code, 1);
}

TEST(Score, WithoutAnObjectMotionIsMeasured) {
  const TemporaryFolder folder;
  const json clip = Score(folder, "demo_drink")["clips"][0];
  EXPECT_TRUE(clip["values"]["penetration_max_mm"].is_null());
  EXPECT_TRUE(clip["values"]["foot_skate_mm_per_frame"].is_number());
  EXPECT_THAT(clip["notes"][0].get<std::string>(), HasSubstr("no object"));
}

TEST(Score, AMeshWithHolesIsMeasuredByStatedFallbacks) {
  const TemporaryFolder folder;
  Fit(folder);
  TriangleMesh mesh = ReadMesh(folder / "held/object.ply");
  mesh.faces.conservativeResize(3, mesh.NumFaces() - 3);
  WriteMesh(mesh, folder / "open.ply");
  const json scores = Score(folder, "held --object open.ply");
  const json& clip = scores["clips"][0];
  EXPECT_EQ(clip["protocol"]["inside_by"], "winding number");
  EXPECT_EQ(clip["values"]["exact_volume_frames_ratio"], 0.0);
  EXPECT_EQ(clip["values"]["intersection_volume_cm3"],
            clip["values"]["intersection_volume_voxel_cm3"]);
  EXPECT_THAT(clip["notes"].dump(), HasSubstr("not watertight"));
  EXPECT_THAT(clip["notes"].dump(), HasSubstr("these frames use voxels of 2 mm"));
  const ProgramResult strict =
      RunHoldfast(folder.Path(), "score held --object open.ply --exact on");
  EXPECT_EQ(strict.exit_code, 1);
  EXPECT_THAT(strict.err, HasSubstr("not watertight"));
}

TEST(Score, AnotherBodyThanTheClipsIsFlagged) {
  const TemporaryFolder folder;
  Fit(folder);
  Clip clip = ReadClip(folder / "held/clip.npz");
  clip.body_model = "SMPLX_FEMALE";
  WriteClip(clip, folder / "held/foreign.npz");
  const json scores = Score(folder, "held/foreign.npz");
  EXPECT_EQ(scores["clips"][0]["foreign_body"], true);
  EXPECT_THAT(scores["clips"][0]["notes"].dump(), HasSubstr("SMPLX_FEMALE"));
  EXPECT_EQ(scores["protocol"]["metrics"]["contact_ratio"]["depends_on_hand_surface"], true);
  const ProgramResult table = RunHoldfast(folder.Path(), "score held/foreign.npz -q");
  EXPECT_THAT(table.out, HasSubstr("foreign*"));
}

TEST(Score, RefusesWhatCannotBeCompared) {
  const TemporaryFolder folder;
  Fit(folder);
  Clip clip = ReadClip(folder / "held/clip.npz");
  WriteClip(Slice(clip, 0, 6), folder / "held/short.npz");
  const ProgramResult lengths = RunHoldfast(folder.Path(), "score held -r held/short.npz");
  EXPECT_EQ(lengths.exit_code, 1);
  EXPECT_THAT(lengths.err, HasSubstr("has 10 frames"));
  EXPECT_THAT(lengths.err, HasSubstr("--overlap"));
  const json overlap = Score(folder, "held -r held/short.npz --overlap");
  EXPECT_EQ(overlap["clips"][0]["reference"]["frames_compared"], 6);
  EXPECT_NEAR(overlap["clips"][0]["values"]["mpjpe_mm"].get<double>(), 0.0, 1e-9);

  clip.frame_rate = 60.0;
  WriteClip(clip, folder / "held/fast.npz");
  const ProgramResult rates = RunHoldfast(folder.Path(), "score held -r held/fast.npz");
  EXPECT_EQ(rates.exit_code, 1);
  EXPECT_THAT(rates.err, HasSubstr("30 Hz"));
  EXPECT_THAT(rates.err, HasSubstr("60 Hz"));
  EXPECT_THAT(
      Score(folder, "held -r held/fast.npz --resample --overlap")["clips"][0]["notes"].dump(),
      HasSubstr("resampled from 60 to 30 Hz"));

  const ProgramResult counts = RunHoldfast(folder.Path(), "score held -r held held");
  EXPECT_EQ(counts.exit_code, 1);
  EXPECT_THAT(counts.err, HasSubstr("one reference for all"));
  EXPECT_EQ(RunHoldfast(folder.Path(), "score held --exact maybe").exit_code, 2);
  EXPECT_EQ(RunHoldfast(folder.Path(), "score").exit_code, 2);
  EXPECT_EQ(RunHoldfast(folder.Path(), "score nowhere.npz").exit_code, 1);
  EXPECT_EQ(RunHoldfast(folder.Path(), "score held -q --voxel 0 --exact off").exit_code, 1);
  std::ofstream(folder / "there.json") << "kept";
  EXPECT_EQ(RunHoldfast(folder.Path(), "score held -q -o there.json").exit_code, 1);
  EXPECT_EQ(ReadText(folder / "there.json"), "kept");
}

}  // namespace
}  // namespace holdfast
