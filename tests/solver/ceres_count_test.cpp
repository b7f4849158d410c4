// SPDX-License-Identifier: MIT
// What solves frames solves them with Ceres: the linker sends every call of ceres::Solve through
// this file (--wrap, tests/CMakeLists.txt), which counts them.
#include <algorithm>
#include <atomic>

#include <ceres/problem.h>
#include <ceres/solver.h>

#include <gtest/gtest.h>

#include "generator/wandr/motion_states.h"
#include "generator/wandr/network.h"
#include "geometry/clip/clip_body.h"
#include "geometry/import/load_clip.h"
#include "geometry/robot/robot_hand.h"
#include "solver/carry/carry.h"
#include "solver/grasp/grasp_set.h"
#include "solver/latent/latent_optimizer.h"
#include "solver/robot/robot.h"
#include "tests/support/robot_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/wandr_scene.h"

namespace {
std::atomic<int> solves = 0;
}

extern "C" {
void __real__ZN5ceres5SolveERKNS_6Solver7OptionsEPNS_7ProblemEPNS0_7SummaryE(
    const ceres::Solver::Options&, ceres::Problem*, ceres::Solver::Summary*);
void __wrap__ZN5ceres5SolveERKNS_6Solver7OptionsEPNS_7ProblemEPNS0_7SummaryE(
    const ceres::Solver::Options& options, ceres::Problem* problem,
    ceres::Solver::Summary* summary) {
  ++solves;
  __real__ZN5ceres5SolveERKNS_6Solver7OptionsEPNS_7ProblemEPNS0_7SummaryE(options, problem,
                                                                          summary);
}
}

namespace holdfast {
namespace {

int Solved(const FitResult& fit) {
  return static_cast<int>(std::ranges::count_if(fit.frames, [](const FrameReport& frame) {
    return frame.stop != StopReason::kGiven && frame.stop != StopReason::kResting;
  }));
}

LoadedClip Motion(const char* name, int frames) {
  LoadedClip loaded = LoadClip(name);
  loaded.clip = Slice(loaded.clip, 0, frames);
  return loaded;
}

TEST(CeresCount, EveryFrameOfAFitIsSolvedByCeres) {
  const LoadedClip motion = Motion("demo_drink", 20);
  const PreparedObject mug = PrepareObject(LoadObject("mug"));
  for (const FitRecipe recipe : {FitRecipe::kHoldfast, FitRecipe::kPaper}) {
    CarryOptions options;
    options.recipe = recipe;
    solves = 0;
    const CarryReport held = CarryObject(motion.clip, motion.body, mug, options);
    EXPECT_EQ(Solved(held.fit), 19);
    EXPECT_GE(solves, 19);
  }
}

TEST(CeresCount, EveryFrameOfAHandOverIsSolvedByCeres) {
  const LoadedClip motion = LoadClip("demo_pass");
  CarryOptions options;
  options.hand_over = true;
  solves = 0;
  const CarryReport passed =
      CarryObject(motion.clip, motion.body, PrepareObject(LoadObject("apple")), options);
  ASSERT_EQ(passed.handovers.size(), 1u);
  EXPECT_GT(Solved(passed.fit), 100);
  EXPECT_GE(solves, Solved(passed.fit));
}

TEST(CeresCount, GraspsAreRefinedByCeres) {
  const PreparedObject mug = PrepareObject(LoadObject("mug"));
  const HandModel hand(BodyModel::Default(), {}, Side::kRight);
  GraspSetOptions options;
  options.count = 3;
  solves = 0;
  const GraspSet set = FindGrasps(hand, mug.object.mesh, *mug.fit.distance, options);
  EXPECT_EQ(set.grasps.size(), 3u);
  EXPECT_GE(solves, 3);
}

TEST(CeresCount, EveryFrameOfATransferToARobotIsSolvedByCeres) {
  const LoadedClip motion = Motion("demo_drink", 10);
  const PreparedObject mug = PrepareObject(LoadObject("mug"));
  ClipScene scene;
  scene.source = "the fit";
  scene.clip = CarryObject(motion.clip, motion.body, mug).clip;
  scene.body = motion.body.model;
  scene.betas = motion.body.betas;
  scene.object = mug.object.mesh;
  const testing::TemporaryFolder folder;
  testing::BoxHand().Write(folder / "hand.urdf");
  const RobotTransferOptions options;
  const RobotTransferSetup setup =
      PrepareRobotTransfer(scene, ReadRobotHand(folder / "hand.urdf"), options);
  solves = 0;
  const RobotTransfer transfer = TransferToRobot(setup, options, {});
  EXPECT_EQ(transfer.poses.size(), 10u);
  EXPECT_GE(solves, 10);
  EXPECT_GE(transfer.iterations, solves);
}

TEST(CeresCount, LatentsAreOptimizedByCeres) {
  const wandr::NetworkWeights weights = wandr::DefaultNetwork();
  const auto& walker = wandr::testing::DefaultBody();
  ReachTask task;
  task.start =
      wandr::StartAtRest(wandr::StandingPose(walker), wandr::Normalizer<double>(weights.statistics))
          .Cast<float>();
  task.goal = {0.0, -1.0, 1.1};
  task.deadline = 60;
  task.num_steps = 72;
  solves = 0;
  const std::vector<ReachSolution> solutions =
      OptimizeLatents(wandr::Network<float>(weights),
                      LatentBodyOf(walker.rest_joints, walker.sole_y), {&task, 1}, {}, 1);
  EXPECT_LT(std::ranges::min(solutions[0].trace.closest_m), 0.1f);
  EXPECT_GE(solves, static_cast<int>(solutions[0].solves.size()));
  EXPECT_GE(solves, 1);
}

}  // namespace
}  // namespace holdfast
