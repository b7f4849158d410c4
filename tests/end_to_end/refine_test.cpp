// SPDX-License-Identifier: MIT
// A fitted clip with noise on its object, cleaned again: the truth is known.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "tests/support/program.h"
#include "tests/support/published_files.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramFolder;
using testing::ReadText;

using Refine = testing::ProgramTest;

double RootMeanSquareTo(const Clip& truth, const Clip& clip) {
  return (clip.object->trans - truth.object->trans).norm() /
         std::sqrt(static_cast<double>(truth.NumFrames()));
}

// Mean second difference of the object's place, per frame.
double Jitter(const Clip& clip) {
  const Eigen::Matrix3Xd& x = clip.object->trans;
  const Eigen::Index n = x.cols();
  return (x.rightCols(n - 2) - 2.0 * x.middleCols(1, n - 2) + x.leftCols(n - 2))
      .colwise()
      .norm()
      .mean();
}

TEST_F(Refine, TakesOutNoiseJitterAndPenetration) {
  folder.Run("fit demo_drink mug --drinking off -o fit --quiet");
  const Clip truth = ReadClip(folder / "fit/clip.npz");
  Clip noisy = truth;
  noisy.holding_hand.clear();
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (int t = 0; t < truth.NumFrames(); ++t) {
    const auto draw = [&](double size) {
      return Eigen::Vector3d(size *
                             Eigen::Vector3d(normal(random), normal(random), normal(random)));
    };
    noisy.object->trans.col(t) += draw(0.005);
    noisy.object->orient.col(t) =
        LogSO3(ExpSO3(truth.object->orient.col(t)) * ExpSO3(draw(3.0 * std::numbers::pi / 180.0)));
  }
  WriteClip(noisy, folder / "noisy.npz");

  const nlohmann::json summary = folder.Json("refine noisy.npz --object fit/object.ply -o clean");
  EXPECT_EQ(summary["schema"], "holdfast/refine/1");
  EXPECT_GT(summary["before"]["frames_deeper_than_2_mm"].get<int>(), 20);
  EXPECT_EQ(summary["after"]["frames_deeper_than_2_mm"], 0);
  EXPECT_GE(summary["after"]["frames_in_contact_ratio"].get<double>(), 0.98);
  ASSERT_EQ(summary["holds"].size(), 1u);
  EXPECT_EQ(summary["holds"][0]["hand"], "right");
  EXPECT_EQ(summary["holds"][0]["rigid"], true);
  EXPECT_NEAR(summary["holds"][0]["noise_mm"].get<double>(), 5.0, 1.0);
  // It moved by about the noise that was added: sqrt(3) of 5 mm.
  EXPECT_NEAR(summary["distance_to_data"]["rms_mm"].get<double>(), 5.0 * std::sqrt(3.0), 1.0);

  const Clip clean = ReadClip(folder / "clean/clip.npz");
  EXPECT_LT(Jitter(clean), Jitter(noisy) / 5.0);
  EXPECT_LT(Jitter(clean), 1.1 * Jitter(truth));
  EXPECT_LT(RootMeanSquareTo(truth, clean), 0.002);
  EXPECT_GT(RootMeanSquareTo(truth, noisy), 0.008);
  const nlohmann::json metrics = folder.ReadJson("clean/metrics.json");
  EXPECT_EQ(metrics["per_frame"]["distance_to_data_mm"].size(), clean.pose.size());
  EXPECT_EQ(metrics["per_frame"]["penetration_depth_mm"].size(), clean.pose.size());
}

// A GRAB file of another person, on the embedded body: the hand is deep in the mug.
TEST_F(Refine, NeverLeavesADeeperFrameThanItFound) {
  folder.Run("fit demo_drink mug -o held -q --no-report --end 12");
  for (const std::string betas : {"0,-3", "3,1"}) {
    const std::string other = "of_" + betas;
    folder.Run("transfer held --betas=" + betas + " -o " + other + " -q --no-report");
    const TriangleMesh mug = ReadMesh(folder / (other + "/object.ply"));
    WriteMesh(mug, folder / "mug.ply");
    testing::WriteGrab(ReadClip(folder / (other + "/clip.npz")), "mug.ply",
                       static_cast<std::size_t>(mug.NumVertices()), folder / "grab.npz");
    const nlohmann::json summary = folder.Json("refine grab.npz -o clean_" + betas);
    const auto deepest = [&](const char* when) {
      return summary[when]["max_penetration_depth_mm"].get<double>();
    };
    EXPECT_GT(deepest("before"), 2.0) << betas;
    EXPECT_LE(deepest("after"), deepest("before") + 1e-6) << betas;
    EXPECT_GE(summary["after"]["frames_in_contact_ratio"].get<double>(), 0.95) << betas;
  }
}

TEST_F(Refine, RefusesAnObjectThatTheTrajectoryIsNotOf) {
  folder.Run("fit demo_drink mug --end 3 -q -o held");
  EXPECT_THAT(folder.Run("refine held/clip.npz --object apple -o out -q", 1).err,
              ::testing::AllOf(HasSubstr("apple: is not the object of the clip's trajectory"),
                               HasSubstr("holdfast fit held/clip.npz apple")));
  EXPECT_EQ(testing::Listing(folder.Path()), "held ");
}

TEST_F(Refine, SaysWhatIsMissing) {
  folder.Fails("refine demo_drink -o out", 1, "has no object trajectory to refine");
  folder.Fails("refine nothing.npz -o out", 1, "nothing.npz");
  folder.Fails("refine demo_drink", 2, "--output");
  EXPECT_THAT(folder.Run("refine --help").out,
              HasSubstr("holdfast refine captured.npz --object mug.obj -o clean"));
}

TEST(FitAllAtOnce, HoldsLikeFrameAfterFrameAndIsTheSameOnAnyThreads) {
  const ProgramFolder folder;
  folder.Run("fit demo_drink mug -o one --solve batch --end 40 --threads 1 --quiet");
  folder.Run("fit demo_drink mug -o two --solve batch --end 40 --threads 2 --quiet");
  EXPECT_EQ(ReadText(folder / "one/clip.npz"), ReadText(folder / "two/clip.npz"));
  const nlohmann::json metrics = folder.ReadJson("one/metrics.json");
  EXPECT_EQ(metrics["options"]["solve"], "batch");
  EXPECT_EQ(metrics["summary"]["frames_in_contact_ratio"], 1.0);
  EXPECT_LT(metrics["summary"]["max_penetration_depth_mm"].get<double>(), 1.0);
}

}  // namespace
}  // namespace holdfast
