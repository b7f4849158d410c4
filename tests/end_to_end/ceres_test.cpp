// SPDX-License-Identifier: MIT
// Commands that solve frames solve them with Ceres: its solves are counted from outside.
#include <algorithm>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/program.h"
#include "tests/support/robot_files.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

struct CountedCeres : ::testing::Test {
  // Solves of Ceres in `holdfast ARGUMENTS`, of all its processes.
  long SolvesOf(const std::string& arguments) {
    const std::string count = (folder / "count").string();
    std::filesystem::remove(count);
    const testing::ProgramResult result = testing::RunHoldfast(
        folder, arguments + " -q",
        "LD_PRELOAD='" HOLDFAST_COUNT_CERES "' HOLDFAST_CERES_COUNT='" + count + "'");
    EXPECT_EQ(result.exit_code, 0) << arguments << "\n" << result.err;
    std::ifstream in(count);
    long sum = 0;
    for (long solves = 0, steps = 0; in >> solves >> steps;) sum += solves;
    return sum;
  }
  nlohmann::json Metrics(const std::string& result) {
    return nlohmann::json::parse(testing::ReadText(folder / result / "metrics.json"));
  }
  // Frames that a fit solved.
  static long Solved(const nlohmann::json& metrics) {
    const nlohmann::json& stops = metrics.at("per_frame").at("stop");
    return std::ranges::count_if(
        stops, [](const nlohmann::json& stop) { return stop != "given" && stop != "resting"; });
  }

  testing::TemporaryFolder temporary;
  std::filesystem::path folder = temporary.Path();
};

TEST_F(CountedCeres, SolvesEveryFrameOfAFit) {
  const long solves = SolvesOf("fit demo_drink mug -o fit --end 40 --no-report");
  const nlohmann::json metrics = Metrics("fit");
  EXPECT_EQ(Solved(metrics), 39);
  EXPECT_GE(solves, 39);
  EXPECT_EQ(metrics.at("solver").at("linear_solver"), "DENSE_NORMAL_CHOLESKY");
  EXPECT_TRUE(metrics.at("solver").at("library").get<std::string>().starts_with("Ceres "));
  EXPECT_GE(SolvesOf("fit demo_drink mug --paper -o paper --end 40 --no-report"), 39);
}

TEST_F(CountedCeres, SolvesEveryFrameOfAHandOver) {
  const long solves = SolvesOf("offhand demo_pass apple -o passed --no-report");
  const long frames = Solved(Metrics("passed"));
  EXPECT_GT(frames, 100);
  EXPECT_GE(solves, frames);
}

TEST_F(CountedCeres, RefinesGrasps) { EXPECT_GE(SolvesOf("grasp mug -o grasp.npz"), 1); }

TEST_F(CountedCeres, SolvesEveryFrameOfATransferToARobot) {
  testing::BoxHand().Write(folder / "hand.urdf");
  ASSERT_EQ(
      testing::RunHoldfast(folder, "fit demo_drink mug -o fit --end 20 -q --no-report").exit_code,
      0);
  EXPECT_GE(SolvesOf("transfer fit --robot hand.urdf -o robot"), 20);
}

TEST_F(CountedCeres, OptimizesLatents) {
  EXPECT_GE(SolvesOf("reach --goal 0.3,0.4,1.1 --method latent-opt --samples 1 -o reach "
                     "--no-report"),
            1);
}

}  // namespace
}  // namespace holdfast
