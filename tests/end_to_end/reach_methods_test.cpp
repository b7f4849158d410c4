// SPDX-License-Identifier: MIT
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/motion_states.h"
#include "geometry/clip/clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/program.h"
#include "tests/support/wandr_scene.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::Listing;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::ReadText;

// With the network that is built in.
class ReachMethods : public ::testing::Test {
 protected:
  ProgramResult Reach(const std::string& arguments) const {
    return folder_.Run("reach --no-report " + arguments);
  }
  nlohmann::json Metrics(const std::string& output) const {
    return folder_.ReadJson(output + "/metrics.json");
  }
  wandr::StateMatrix<double> States(const std::string& output) const {
    return wandr::StatesOfClip(ReadClip(folder_ / (output + "/clip.npz")));
  }
  // Of a wrist and a place, in a frame of the clip.
  double Distance(const std::string& output, int frame, Side side, const Vector3d& goal) const {
    const auto pose = wandr::PoseOf<double>(States(output).col(frame));
    return (wandr::WristPosition(wandr::testing::DefaultBones(), pose, side) - goal).norm();
  }

  ProgramFolder folder_;
};

TEST_F(ReachMethods, LatentOptimizationPutsTheWristThere) {
  const ProgramResult result =
      Reach("--goal 0.3,-1.3,1.1 --method latent-opt --samples 2 --all -o out");
  EXPECT_THAT(result.out, HasSubstr("1 of 1 goal reached"));
  EXPECT_THAT(result.out, HasSubstr("best of 2 with latent-opt; 2 reach the goal"));
  EXPECT_EQ(Listing(folder_ / "out"), "clip.npz metrics.json samples ");
  const nlohmann::json metrics = Metrics("out");
  EXPECT_EQ(metrics["options"]["method"], "latent-opt");
  EXPECT_EQ(metrics["options"]["samples"], 2);
  EXPECT_EQ(metrics["options"]["refit"], true);
  const nlohmann::json& goal = metrics["goals"][0];
  EXPECT_EQ(goal["reached"], true);
  EXPECT_TRUE(goal["why_missed"].is_null());
  EXPECT_LT(goal["closest_m"].get<double>(), 1e-3) << "the refit is exact";
  const nlohmann::json& refit = metrics["refit"];
  ASSERT_EQ(refit["wrist_errors_m"].size(), 1u);
  EXPECT_LT(refit["wrist_errors_m"][0].get<double>(), 1e-3);
  EXPECT_GT(refit["max_foot_correction_m"].get<double>(), 0.0);
  // The clip has what the metrics say.
  EXPECT_NEAR(Distance("out", goal["closest_frame"], Side::kRight, {0.3, -1.3, 1.1}),
              goal["closest_m"].get<double>(), 1e-4);
  folder_.Run("score out");
}

TEST_F(ReachMethods, WithoutRefitItIsTheNetworksMotion) {
  const std::string reach = "--goal 0.3,-1.3,1.1 --method latent-opt --samples 1 ";
  Reach(reach + "-o touched");
  Reach(reach + "--no-refit -o bare");
  const nlohmann::json bare = Metrics("bare");
  EXPECT_EQ(bare["options"]["refit"], false);
  EXPECT_FALSE(bare.contains("refit"));
  EXPECT_LT(bare["goals"][0]["closest_m"].get<double>(), 0.01);
  EXPECT_GT(bare["goals"][0]["closest_m"].get<double>(), 1e-5);
  EXPECT_LT(Metrics("touched")["goals"][0]["closest_m"].get<double>(),
            bare["goals"][0]["closest_m"].get<double>());
  const Clip a = ReadClip(folder_ / "bare/clip.npz"), b = ReadClip(folder_ / "touched/clip.npz");
  ASSERT_EQ(a.NumFrames(), b.NumFrames());
  EXPECT_LT((a.trans - b.trans).colwise().norm().maxCoeff(), 0.1) << "the same motion, touched up";
}

TEST_F(ReachMethods, TheBaselineOfThePaper) {
  EXPECT_THAT(Reach("--goal 0.3,-1.0,1.1 --method vae-opt --samples 1 -o out").out,
              HasSubstr("with vae-opt"));
  const nlohmann::json metrics = Metrics("out");
  EXPECT_EQ(metrics["options"]["method"], "vae-opt");
  EXPECT_LT(metrics["goals"][0]["closest_m"].get<double>(), 0.05);
  EXPECT_FALSE(metrics.contains("refit")) << "left as published";
  EXPECT_EQ(metrics["summary"]["frames"], metrics["goals"][0]["due_frame"].get<int>() + 1);
  const nlohmann::json& solve = metrics["summary"]["latent_solves"][0];
  EXPECT_EQ(solve["minimizer"], "LEVENBERG_MARQUARDT");
  EXPECT_EQ(solve["linear_solver"], "CGNR");
  EXPECT_GT(solve["iterations"], 0);
  EXPECT_NE(solve["termination"], "FAILURE");
}

TEST_F(ReachMethods, TheBaselinesOptimizersByName) {
  const std::string reach = "--goal 0.3,-1.0,1.1 --method vae-opt --samples 1 --iterations 12 ";
  const std::pair<std::string, std::string> kNames[] = {
      {"lbfgs", "LBFGS"}, {"lbfgs-step1", "LBFGS_STEP_ONE"}, {"adam", "ADAM"}};
  for (const auto& [name, minimizer] : kNames) {
    Reach(reach + "--prior-weight 1e-5 --optimizer " + name + " -o " + name);
    const nlohmann::json metrics = Metrics(name);
    EXPECT_EQ(metrics["options"]["vae_opt"]["optimizer"], name);
    EXPECT_EQ(metrics["options"]["vae_opt"]["iterations"], 12);
    EXPECT_EQ(metrics["options"]["vae_opt"]["prior_weight"], 1e-5);
    const nlohmann::json& solve = metrics["summary"]["latent_solves"][0];
    EXPECT_EQ(solve["minimizer"], minimizer);
    EXPECT_EQ(solve["linear_solver"], "");
    EXPECT_LE(solve["iterations"], 12);
  }
}

TEST_F(ReachMethods, TheLeftWristReachesAsWell) {
  for (const std::string method : {"latent-opt", "vae-opt"}) {
    Reach("--goal 0.3,-1.0,1.1 --wrist left --samples 1 --method " + method + " -o " + method);
    const nlohmann::json metrics = Metrics(method);
    EXPECT_EQ(metrics["options"]["wrist"], "left");
    const nlohmann::json& goal = metrics["goals"][0];
    EXPECT_EQ(goal["reached"], true) << method;
    const double bound = method == "latent-opt" ? 1e-3 : 0.05;
    EXPECT_LT(goal["closest_m"].get<double>(), bound);
    const Vector3d place(0.3, -1.0, 1.1);
    EXPECT_LT(Distance(method, goal["closest_frame"], Side::kLeft, place), bound + 1e-4);
    EXPECT_GT(Distance(method, goal["closest_frame"], Side::kRight, place), 0.1);
  }
}

TEST_F(ReachMethods, TheSameBytesOnAnyThreads) {
  const std::string reach =
      "--goal 0.3,-0.9,1.1 --goal -0.3,-1.2,0.9 --method latent-opt --samples 2 --quiet ";
  Reach(reach + "--threads 1 -o one");
  Reach(reach + "--threads 2 -o two");
  EXPECT_EQ(ReadText(folder_ / "one/clip.npz"), ReadText(folder_ / "two/clip.npz"));
  EXPECT_EQ(ReadText(folder_ / "one/metrics.json"), ReadText(folder_ / "two/metrics.json"));
  const nlohmann::json metrics = Metrics("one");
  EXPECT_EQ(metrics["summary"]["goals_reached"], 2);
  EXPECT_EQ(metrics["goals"][0]["left_frame"], metrics["goals"][1]["taken_on_frame"]);
}

TEST_F(ReachMethods, SaysWhyAGoalIsMissed) {
  const auto why = [&](const std::string& arguments, const std::string& output) {
    const ProgramResult result = Reach(arguments + " --samples 1 -o " + output);
    EXPECT_THAT(result.out, HasSubstr("0 of 1 goal reached"));
    const nlohmann::json goal = Metrics(output)["goals"][0];
    EXPECT_EQ(goal["reached"], false);
    EXPECT_GT(goal["closest_m"].get<double>(), 0.1);
    const std::string said = goal["why_missed"].is_string() ? goal["why_missed"] : "nothing";
    EXPECT_THAT(result.out, HasSubstr(said)) << "in the text as in the metrics";
    return said;
  };
  EXPECT_THAT(why("--goal 0.2,-0.7,2.7 --method latent-opt --time 1.5", "high"),
              HasSubstr("too high: on flat feet this body's wrist reaches"));
  EXPECT_THAT(why("--goal 0,-6,1.1 --method latent-opt --time 1", "soon"),
              HasSubstr("out of time: 6.0 m in 1.0 s is faster than walking"));
}

TEST_F(ReachMethods, GoesAroundAnObstacle) {
  const Vector3d low(-0.2, -1.1, 0.0), high(0.2, -0.8, 1.0);
  WriteMesh(testing::Box(low, high), folder_ / "pillar.obj");
  const std::string reach = "--goal 0,-2,1.1 --method latent-opt --samples 2 ";
  Reach(reach + "-o through");
  Reach(reach + "--obstacle pillar.obj -o around");
  EXPECT_EQ(Metrics("around")["options"]["obstacles"], nlohmann::json({"pillar.obj"}));
  EXPECT_EQ(Metrics("around")["goals"][0]["reached"], true);
  const auto deepest = [&](const std::string& output) {
    const wandr::StateMatrix<double> states = States(output);
    double depth = -INFINITY;
    for (Eigen::Index t = 0; t < states.cols(); ++t) {
      wandr::BodyKinematics<double> at;
      wandr::ForwardKinematics(wandr::testing::DefaultBones(), wandr::PoseOf<double>(states.col(t)),
                               at);
      for (int k = 0; k < kNumBodyJoints; ++k) {
        depth = std::max(depth, -testing::BoxDistance(at.joints.col(k), low, high));
      }
    }
    return depth;
  };
  EXPECT_GT(deepest("through"), 0.1);
  EXPECT_LT(deepest("around"), 0.4 * deepest("through"));

  // The left wrist's way is found in a mirror: a goal in a pillar that is aside is refused, in its
  // mirror image it is not.
  WriteMesh(testing::Box({0.1, -0.9, 0.0}, {0.6, -0.7, 1.2}), folder_ / "aside.obj");
  const std::string aside =
      "--wrist left --method latent-opt --samples 1 --obstacle aside.obj --time 1.5 ";
  folder_.Fails("reach --no-report " + aside + "--goal 0.3,-0.8,1.1 -o inside", 1,
                "is 0.10 m inside the obstacle aside.obj");
  Reach(aside + "--goal -0.3,-0.8,1.1 -o outside");
}

TEST_F(ReachMethods, ArrivesWhenItSuitsOrFromWhereItIsAsked) {
  const std::string reach = "--goal 0.3,-1.0,1.1 --method latent-opt --samples 1 ";
  Reach(reach + "--free-time -o free");
  EXPECT_EQ(Metrics("free")["options"]["free_time"], true);
  EXPECT_LT(Metrics("free")["goals"][0]["closest_m"].get<double>(), 0.02);

  for (const Side side : {Side::kRight, Side::kLeft}) {
    const std::string name = side == Side::kRight ? "right" : "left";
    Reach(reach + "--approach 0.5,-0.7,-0.5 --wrist " + name + " -o " + name);
    const nlohmann::json goal = Metrics(name)["goals"][0];
    EXPECT_LT(goal["closest_m"].get<double>(), 0.01);
    const wandr::StateMatrix<double> states = States(name);
    wandr::BodyKinematics<double> at;
    wandr::ForwardKinematics(wandr::testing::DefaultBones(),
                             wandr::PoseOf<double>(states.col(goal["due_frame"].get<int>())), at);
    const int wrist = WristJoint(side);
    const Vector3d forearm = at.joints.col(wrist) - at.joints.col(kJointParents[wrist]);
    EXPECT_GT(forearm.normalized().dot(Vector3d(0.5, -0.7, -0.5).normalized()), 0.75) << name;
  }
}

TEST_F(ReachMethods, BadInputIsNamed) {
  const auto fails = [&](const std::string& arguments, int code, const std::string& says) {
    folder_.Fails("reach --no-report --goal 0.3,-1,1.1 -o bad " + arguments, code, says);
  };
  std::ofstream(folder_ / "broken.obj") << "v 1 2 x\n";
  fails("--method latent-opt --obstacle broken.obj", 1, "broken.obj:1");
  fails("--method latent-opt --obstacle nowhere.obj", 1, "nowhere.obj: does not exist");
  std::ofstream(folder_ / "empty.obj") << "";
  fails("--method latent-opt --obstacle empty.obj", 1, "empty.obj");
  fails("--obstacle broken.obj", 1, "Add --method latent-opt");
  fails("--method latent", 2, "latent-opt");
  fails("--method vae-opt --optimizer newton", 2, "lbfgs-step1");
  fails("--method vae-opt --iterations 0", 2, "--iterations");
  fails("--method vae-opt --prior-weight -1", 2, "--prior-weight");
  fails("--iterations 5", 1, "Add --method vae-opt");
  fails("--method latent-opt --approach 1,2", 1, "--approach 1,2: is not three finite numbers");
  fails("--method latent-opt --approach 0,0,0", 1, "--approach: has no direction");
  fails("--method latent-opt --approach 0,0,1 --free-time", 2, "--free-time");
  fails("--samples 0", 2, "--samples");
  fails("--object mug", 2, "--grasp");
  fails("--grasp", 2, "--object");
  fails("--object mug --grasp pinch", 2, "precision");
  fails("--object-yaw 30", 2, "--object");
  fails("--object mgu --grasp", 1, "one of: apple");
}

TEST_F(ReachMethods, TakesAnObjectFromATableAndCarriesIt) {
  EXPECT_THAT(
      Reach("--object mug --grasp --goal 0.6,-1.2,0.8 --goal -0.5,-1.4,1.0 --method latent-opt "
            "--samples 2 -o taken")
          .out,
      HasSubstr("mug taken after"));
  EXPECT_EQ(Listing(folder_ / "taken"), "clip.npz metrics.json object.ply table.ply ");
  const nlohmann::json metrics = Metrics("taken");
  EXPECT_EQ(metrics["schema"], "holdfast/reach-take/1");
  const nlohmann::json& summary = metrics["summary"];
  EXPECT_LT(summary["take_wrist_error_mm"].get<double>(), 1.0);
  EXPECT_LT(summary["object_in_table_mm"].get<double>(), 1.0);
  EXPECT_LT(summary["body_in_table_mm"].get<double>(), 20.0);
  EXPECT_GT(summary["contact"]["frames_in_contact_ratio"].get<double>(), 0.95);

  const Clip clip = ReadClip(folder_ / "taken/clip.npz");
  EXPECT_EQ(clip.NumFrames(), summary["frames"].get<int>());
  ASSERT_TRUE(clip.object.has_value());
  ASSERT_TRUE(clip.table.has_value());
  EXPECT_EQ(clip.object->trans.cols(), clip.NumFrames());
  EXPECT_EQ(clip.table->trans.cols(), clip.NumFrames());
  EXPECT_EQ(clip.object->mesh, "object.ply");
  // It stands still until it is taken, on the table and at its place, then it is carried.
  const int taken = metrics["take"]["frames"]["taken"];
  ASSERT_GT(taken, 30);
  ASSERT_LT(taken, clip.NumFrames() - 30);
  for (int t = 0; t < taken; ++t) {
    EXPECT_LT((clip.object->trans.col(t) - clip.object->trans.col(0)).norm(), 5e-4) << t;
    EXPECT_LT((clip.object->orient.col(t) - clip.object->orient.col(0)).norm(), 5e-3) << t;
  }
  const TriangleMesh mug = ReadMesh(folder_ / "taken/object.ply");
  const auto bottom = [&](int frame) {
    const Eigen::Matrix3d R = ExpSO3(clip.object->orient.col(frame));
    return ((R * mug.vertices).colwise() + clip.object->trans.col(frame)).row(2).minCoeff();
  };
  EXPECT_NEAR(bottom(0), 0.8, 1e-3);
  EXPECT_NEAR(clip.table->trans(2, 0), 0.8, 1e-3);
  EXPECT_NEAR(bottom(clip.NumFrames() - 1), 1.0, 0.02);
  EXPECT_GT((clip.object->trans.rightCols<1>() - clip.object->trans.col(0)).head<2>().norm(), 0.9);
  folder_.Run("score taken");
}

}  // namespace
}  // namespace holdfast
