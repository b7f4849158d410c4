// SPDX-License-Identifier: MIT
#include "solver/body_ik/reach_refit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "generator/matching/foot_lock.h"
#include "generator/wandr/motion_states.h"
#include "generator/wandr/network.h"
#include "generator/wandr/reach_goals.h"
#include "generator/wandr/reach_outcome.h"
#include "geometry/body/body_model.h"
#include "geometry/error.h"
#include "solver/latent/reach_by_optimization.h"
#include "tests/support/wandr_scene.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;
using wandr::testing::DefaultBody;
using wandr::testing::DefaultBones;
using States = wandr::StateMatrix<double>;

constexpr int kWrist = 21;

struct Shipped {
  Shipped() : weights(wandr::DefaultNetwork()), network(weights) {}
  wandr::NetworkWeights weights;
  wandr::Network<float> network;
};
const Shipped& Net() {
  static const Shipped shipped;
  return shipped;
}

wandr::RolloutStart<float> Standing() {
  return wandr::StartAtRest(wandr::StandingPose(DefaultBody()),
                            wandr::Normalizer<double>(Net().weights.statistics))
      .Cast<float>();
}

// What the network makes of a goal in the time that a stroll takes, no more.
wandr::ReachSample Walk(const Vector3d& goal, std::uint64_t seed = 1) {
  wandr::ReachGoalsOptions options;
  options.frames = wandr::DeadlineRule{}.Frames(goal.head<2>().norm());
  options.seed = seed;
  return wandr::ReachGoals(Net().network, DefaultBones().Cast<float>(), Standing(), {&goal, 1}, 1,
                           1, options)[0];
}

// The first of its samples that comes to the goal.
wandr::ReachSample WalkThere(const Vector3d& goal) {
  constexpr std::uint64_t kMost = 8;
  wandr::ReachSample sample;
  for (std::uint64_t seed = 1; seed <= kMost; ++seed) {
    sample = Walk(goal, seed);
    if (sample.goals[0].Reached()) break;
  }
  return sample;
}

std::vector<wandr::BodyKinematics<double>> Kinematics(const States& states) {
  std::vector<wandr::BodyKinematics<double>> all(static_cast<std::size_t>(states.cols()));
  for (Eigen::Index t = 0; t < states.cols(); ++t) {
    wandr::ForwardKinematics(DefaultBones(), wandr::PoseOf<double>(states.col(t)), all[t]);
  }
  return all;
}

std::vector<Soles> SolesOf(const States& states) {
  const SolePoints points(DefaultBody().rest_joints, DefaultBody().sole_y);
  std::vector<Soles> soles;
  for (const wandr::BodyKinematics<double>& at : Kinematics(states)) {
    BodyPlacement placed;
    for (std::size_t k = 0; k < kNumBodyJoints; ++k) placed.rotation[k] = at.world[k];
    placed.joints = at.joints;
    soles.push_back(points.At(placed));
  }
  return soles;
}

// How a planted foot slides: meters per frame of what it stands on, in a frame and the next (the
// ball if it is down, else the heel). A foot that was dragged too far makes a step instead: there
// are a few large ones even where feet are pinned.
struct Sliding {
  double mean_m = 0.0;
  double share = 0.0;  // of frames, by more than a millimeter
};

Sliding SlidingOf(const States& states, const std::vector<SoleBits>& contacts) {
  const std::vector<Soles> soles = SolesOf(states);
  Sliding sliding;
  int count = 0;
  for (std::size_t t = 0; t + 1 < soles.size(); ++t) {
    for (const int heel : {0, 2}) {
      const auto stands_on = [&](SoleBits bits) {
        return bits & (2 << heel) ? heel + 1 : bits & (1 << heel) ? heel : -1;
      };
      const int point = stands_on(contacts[t]);
      if (point < 0 || point != stands_on(contacts[t + 1])) continue;
      const double way = (soles[t + 1].col(point) - soles[t].col(point)).head<2>().norm();
      sliding.mean_m += way;
      sliding.share += way > 1e-3;
      ++count;
    }
  }
  EXPECT_GT(count, 50);
  sliding.mean_m /= count;
  sliding.share /= count;
  return sliding;
}

// Of a joint from one motion to another, meters.
struct Moves {
  double largest_m = 0.0, mean_m = 0.0;
};

Moves MovesBetween(const States& a, const States& b) {
  const auto before = Kinematics(a), after = Kinematics(b);
  Moves moves;
  for (std::size_t t = 0; t < before.size(); ++t) {
    const auto norms = (after[t].joints - before[t].joints).colwise().norm().eval();
    moves.largest_m = std::max(moves.largest_m, norms.maxCoeff());
    moves.mean_m += norms.mean() / static_cast<double>(before.size());
  }
  return moves;
}

TEST(RefitReach, PinsPlantedFeetAndPutsTheWristWhereItShallBe) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    const States before = Walk({0.3, -1.5, 1.1}, seed).track.states.cast<double>();
    const int frame = static_cast<int>(before.cols()) - 20;
    const RefitGoal goal = {
        Kinematics(before)[frame].joints.col(kWrist) + Vector3d(0.02, -0.03, 0.02), frame};
    RefitReport report;
    RefitOptions options;
    options.walks = false;
    const States after = RefitReach(DefaultBody(), before, {&goal, 1}, options, &report);
    ASSERT_EQ(after.cols(), before.cols());
    EXPECT_TRUE(after.allFinite());
    ASSERT_EQ(report.wrist_errors_m.size(), 1u);
    EXPECT_LT(report.wrist_errors_m[0], 1e-3);
    EXPECT_NEAR((Kinematics(after)[frame].joints.col(kWrist) - goal.position).norm(),
                report.wrist_errors_m[0], 1e-6)
        << "what is said is so";
    const std::vector<SoleBits> contacts = FindSupports(SolesOf(before), wandr::kFramesPerSecond);
    const Sliding slid = SlidingOf(before, contacts), slides = SlidingOf(after, contacts);
    EXPECT_GT(slid.share, 0.5) << "the network's feet do slide";
    EXPECT_LT(slides.share, 0.4 * slid.share);
    EXPECT_LT(slides.mean_m, 0.8 * slid.mean_m);
    EXPECT_GT(report.max_foot_correction_m, 0.0);
    // Still the motion that it was, but for a step that had to be longer.
    const Moves moves = MovesBetween(before, after);
    EXPECT_LT(moves.mean_m, 0.03);
    EXPECT_LT(moves.largest_m, 0.3);
    // Nor does it tremble: the largest step of any joint grows little.
    const auto largest_step = [](const States& states) {
      const auto at = Kinematics(states);
      double most = 0.0;
      for (std::size_t t = 0; t + 1 < at.size(); ++t) {
        most = std::max(most, (at[t + 1].joints - at[t].joints).colwise().norm().maxCoeff());
      }
      return most;
    };
    EXPECT_LT(largest_step(after), 1.3 * largest_step(before) + 0.01);
  }
}

TEST(RefitReach, TheWristStaysAtALastGoalAndThePersonComesToRest) {
  for (const Vector3d& place : {Vector3d(0.3, -1.5, 1.1), Vector3d(-0.9, -1.2, 0.8)}) {
    SCOPED_TRACE(place.transpose());
    const wandr::ReachSample sample = WalkThere(place);
    ASSERT_TRUE(sample.goals[0].Reached());
    const States before = sample.track.states.cast<double>();
    const int count = static_cast<int>(before.cols());
    const int frame = std::min(sample.goals[0].closest_frame, count - 16);
    RefitGoal goal = {place, frame};
    const auto farthest = [&](const States& states) {
      const auto at = Kinematics(states);
      double most = 0.0;
      for (int t = frame; t < count; ++t) {
        most = std::max(most, (at[t].joints.col(kWrist) - place).norm());
      }
      return most;
    };
    // Of the joints, in m/s, over some frames to `last`.
    const auto speed = [&](const States& states, int last, int frames) {
      const auto at = Kinematics(states);
      double way = 0.0;
      for (int t = last - frames; t < last; ++t) {
        way += (at[t + 1].joints - at[t].joints).colwise().norm().mean();
      }
      return way / frames * wandr::kFramesPerSecond;
    };
    RefitOptions options;
    options.farthest_m = 0.2;
    const States passed = RefitReach(DefaultBody(), before, {&goal, 1}, options);
    goal.rests = true;
    const States rested = RefitReach(DefaultBody(), before, {&goal, 1}, options);
    EXPECT_GT(farthest(passed), 0.02) << "it would not have stayed";
    EXPECT_LT(farthest(rested), 0.02);
    EXPECT_LT(speed(rested, count - 1, 8), 0.15) << "of 0.7 on the way";
    EXPECT_GT(speed(rested, count - 1, 1), 1e-4) << "a statue";
    EXPECT_LT((rested.leftCols(frame - 30) - passed.leftCols(frame - 30)).cwiseAbs().maxCoeff(),
              0.05)
        << "what is long before is left alone, but for feet";
  }
}

TEST(RefitRollout, SkatesLessBeginsAsItDidAndIsWhereItReached) {
  const Vector3d goal(0.3, -1.5, 1.1);
  const wandr::LowestPoint lowest{BodySurface(BodyModel::Default())};
  wandr::ReachSample sample = WalkThere(goal);
  ASSERT_TRUE(sample.goals[0].Reached());
  const wandr::RolloutTrack before = sample.track;
  const RefitGoal reached{goal, sample.goals[0].closest_frame};
  const RefitReport report = RefitRollout(DefaultBody(), {&reached, 1}, Side::kRight, sample.track);
  wandr::MeasureGoals({&goal, 1}, kWrist, sample);
  EXPECT_LT(sample.goals[0].closest_m, 1e-3);
  EXPECT_NEAR(sample.goals[0].closest_m, report.wrist_errors_m.at(0), 1e-4);
  EXPECT_LT(wandr::SkatingOfLowestVertex(lowest, sample.track.states),
            0.5 * wandr::SkatingOfLowestVertex(lowest, before.states));
  EXPECT_LT((sample.track.states.col(0) - before.states.col(0)).cwiseAbs().maxCoeff(), 2e-3f)
      << "it goes on from where it was asked to";
  const Eigen::MatrixXf joints =
      wandr::JointsOfStates(sample.track.states, DefaultBones().Cast<float>());
  EXPECT_LT((joints - sample.track.joints).cwiseAbs().maxCoeff(), 1e-5f);

  // A motion that nothing was reached in, and one too short for a wrist to be placed.
  wandr::RolloutTrack shorter = before;
  shorter.states = before.states.leftCols(12).eval();
  shorter.joints = before.joints.leftCols(12).eval();
  const RefitGoal early{goal, 5};
  EXPECT_GT(RefitRollout(DefaultBody(), {&early, 1}, Side::kRight, shorter).wrist_errors_m.at(0),
            0.1);
  EXPECT_TRUE(shorter.states.allFinite());
}

TEST(RefitReach, DoesWhatItIsAskedAndNoMore) {
  const States before = Walk({0.3, -1.5, 1.1}).track.states.cast<double>();
  const int frame = static_cast<int>(before.cols()) - 25;
  const Vector3d wrist = Kinematics(before)[frame].joints.col(kWrist);
  const RefitGoal goal = {wrist + Vector3d(0.0, 0.0, 0.04), frame};
  RefitOptions options;
  options.pin_feet = options.place_wrist = options.lift_hands = options.walks = false;
  RefitReport report;
  const States same = RefitReach(DefaultBody(), before, {&goal, 1}, options, &report);
  EXPECT_LT((same - before).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_NEAR(report.wrist_errors_m.at(0), 0.04, 1e-6);
  EXPECT_EQ(report.max_foot_correction_m, 0.0);
  EXPECT_EQ(report.max_hand_bend_rad, 0.0);

  // With feet pinned the wrist's share of the change is within its window, and feet stay.
  options.pin_feet = true;
  const States pinned = RefitReach(DefaultBody(), before, {&goal, 1}, options, &report);
  EXPECT_GT(report.wrist_errors_m.at(0), 0.02);
  options.place_wrist = true;
  options.window_frames = 20;
  const States placed = RefitReach(DefaultBody(), before, {&goal, 1}, options, &report);
  EXPECT_LT(report.wrist_errors_m.at(0), 1e-3);
  const auto then = Kinematics(pinned), now = Kinematics(placed);
  for (int t = 0; t < static_cast<int>(before.cols()); ++t) {
    if (std::abs(t - frame) >= options.window_frames) {
      EXPECT_LT((placed.col(t) - pinned.col(t)).cwiseAbs().maxCoeff(), 2e-3) << "frame " << t;
    }
    for (const int foot : {7, 8, 10, 11}) {
      EXPECT_LT((now[t].joints.col(foot) - then[t].joints.col(foot)).norm(), 5e-3) << "frame " << t;
    }
  }
  options.pin_feet = false;
  // A goal that the motion did not come to is left alone, and so is one without room around it.
  const RefitGoal far = {wrist + Vector3d(0.0, 0.0, 0.3), frame};
  const States missed = RefitReach(DefaultBody(), before, {&far, 1}, options, &report);
  EXPECT_LT((missed - before).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_NEAR(report.wrist_errors_m.at(0), 0.3, 1e-6);
  const int last = static_cast<int>(before.cols()) - 1;
  const RefitGoal at_end = {Kinematics(before)[last].joints.col(kWrist) + Vector3d(0, 0, 0.02),
                            last};
  RefitReach(DefaultBody(), before, {&at_end, 1}, options, &report);
  EXPECT_NEAR(report.wrist_errors_m.at(0), 0.02, 1e-6);
}

TEST(RefitReach, LiftsHandsOffTheFloor) {
  // A hand held out level, pushed down until it goes through the floor.
  States before = Walk({0.3, -1.2, 0.2}).track.states.cast<double>();
  const Eigen::Matrix3Xd& rest = DefaultBody().rest_joints;
  const auto lowest_tip = [&](const States& states, int wrist, int knuckle) {
    double lowest = INFINITY;
    for (const auto& at : Kinematics(states)) {
      const Vector3d tip =
          at.joints.col(wrist) + at.world[wrist] * (1.13 * (rest.col(knuckle) - rest.col(wrist)));
      lowest = std::min(lowest, tip.z());
    }
    return lowest;
  };
  // The motion as a whole sinks until the hand is 4 cm in the ground.
  const double sink = lowest_tip(before, kWrist, 45) + 0.04;
  before.row(2).array() -= sink;
  double lowest_wrist = INFINITY;
  for (const auto& at : Kinematics(before)) {
    lowest_wrist = std::min(lowest_wrist, at.joints(2, kWrist));
  }
  ASSERT_GT(lowest_wrist, 0.02) << "the wrist itself is above the floor";
  RefitOptions options;
  options.pin_feet = options.place_wrist = options.walks = false;
  RefitReport report;
  const States after = RefitReach(DefaultBody(), before, {}, options, &report);
  EXPECT_GT(report.max_hand_bend_rad, 0.05);
  EXPECT_LE(report.max_hand_bend_rad, 70.0 * M_PI / 180.0 + 1e-9);
  EXPECT_LT(lowest_tip(before, kWrist, 45), -0.039);
  EXPECT_GT(lowest_tip(after, kWrist, 45), 0.0);
  EXPECT_GT(lowest_tip(after, 20, 30), std::min(0.0, lowest_tip(before, 20, 30)));
  // Wrists and all else stay where they are.
  EXPECT_LT(MovesBetween(before, after).largest_m, 1e-5);

  options.lift_hands = false;
  RefitReach(DefaultBody(), before, {}, options, &report);
  EXPECT_EQ(report.max_hand_bend_rad, 0.0);
}

TEST(RefitReach, RefusesFramesThatAreNone) {
  const States states = Walk({0.3, -0.8, 1.1}).track.states.cast<double>();
  const auto refit = [&](int frame, double z) {
    const RefitGoal goal = {{0.3, -0.8, z}, frame};
    return RefitReach(DefaultBody(), states, {&goal, 1});
  };
  EXPECT_THROW(refit(-1, 1.1), Error);
  EXPECT_THROW(refit(static_cast<int>(states.cols()), 1.1), Error);
  EXPECT_THROW(refit(30, std::numeric_limits<double>::quiet_NaN()), Error);
  EXPECT_NO_THROW(refit(0, 1.1));
}

std::vector<OptimizedReach> Reach(const std::vector<Vector3d>& goals, int count, int threads,
                                  const ReachByOptimizationOptions& options = {}) {
  return ReachByOptimization(Net().network, DefaultBody(), Standing(), goals, count, threads,
                             options);
}

TEST(ReachByOptimization, GoesFromGoalToGoalWithoutAJump) {
  const std::vector<Vector3d> goals = {{0.3, -1.3, 1.1}, {-0.6, -1.6, 0.8}};
  for (const bool refit : {true, false}) {
    SCOPED_TRACE(refit);
    ReachByOptimizationOptions options;
    options.refit = refit;
    const OptimizedReach reach = Reach(goals, 1, 1, options)[0];
    const wandr::ReachSample& sample = reach.sample;
    ASSERT_FALSE(sample.diverged);
    ASSERT_EQ(sample.NumReached(), 2);
    const int frames = static_cast<int>(sample.track.states.cols());
    ASSERT_EQ(sample.track.joints.cols(), frames);
    ASSERT_EQ(static_cast<int>(sample.goal_of_frame.size()), frames);
    EXPECT_EQ(sample.goals[0].taken_on, 0);
    EXPECT_EQ(sample.goals[1].taken_on, sample.goals[0].left);
    EXPECT_EQ(sample.goals[1].left, frames - 1);
    const auto wrist = [&](int t) -> Vector3d {
      return sample.track.joints.block<3, 1>(3 * kWrist, t).cast<double>();
    };
    for (std::size_t g = 0; g < 2; ++g) {
      const wandr::GoalOutcome& goal = sample.goals[g];
      EXPECT_LT(goal.closest_m, refit ? 1e-3 : 0.02) << "goal " << g;
      EXPECT_NEAR(goal.closest_m, (wrist(goal.closest_frame) - goals[g]).norm(), 1e-6);
      EXPECT_GE(goal.left - goal.due, 15) << "the wrist stays a while";
      if (refit) {
        ASSERT_EQ(reach.refit.wrist_errors_m.size(), 2u);
        EXPECT_LT(reach.refit.wrist_errors_m[g], 1e-3) << "goal " << g;
      }
    }
    // Joints as the states have them.
    EXPECT_LT((wandr::JointsOfStates(sample.track.states, DefaultBones().Cast<float>()) -
               sample.track.joints)
                  .cwiseAbs()
                  .maxCoeff(),
              1e-5F);
    const Eigen::MatrixXd joints = sample.track.joints.cast<double>();
    const int seam = sample.goals[0].left;
    double step = 0.0, acceleration = 0.0;
    for (int t = seam - 3; t <= seam + 3; ++t) {
      for (int k = 0; k < kNumBodyJoints; ++k) {
        const auto at = [&](int f) { return Vector3d(joints.block<3, 1>(3 * k, f)); };
        step = std::max(step, (at(t + 1) - at(t)).norm());
        acceleration = std::max(acceleration, 900.0 * (at(t + 1) - 2.0 * at(t) + at(t - 1)).norm());
      }
    }
    EXPECT_LT(step, 0.06);
    EXPECT_LT(acceleration, 30.0);
    EXPECT_LT(wandr::MeasureReach(sample.track.joints, goals[1]).peak_pelvis_m_s, 2.2);
  }
}

TEST(ReachByOptimization, SaysThatItDidNotComeUpThere) {
  ReachByOptimizationOptions options;
  options.latent.lbfgs_iterations = 30;
  const std::vector<Vector3d> goals = {{0.2, -0.8, 2.7}, {0.2, -0.8, 1.1}};
  const OptimizedReach reach = Reach(goals, 1, 1, options)[0];
  EXPECT_FALSE(reach.sample.goals[0].Reached());
  EXPECT_GT(reach.sample.goals[0].closest_m, 0.3);
  EXPECT_TRUE(reach.sample.goals[1].Reached()) << "and goes on to the next";
  EXPECT_LT(reach.sample.goals[1].closest_m, 0.02);
  EXPECT_EQ(reach.refit.wrist_errors_m.size(), 1u) << "only what was reached is refitted";
}

TEST(ReachByOptimization, NeitherThreadsNorTheNumberOfMotionsChangesOne) {
  ReachByOptimizationOptions options;
  options.latent.lbfgs_iterations = 10;
  options.latent.lm_iterations = 2;
  const std::vector<Vector3d> goals = {{0.3, -0.7, 1.1}, {-0.3, -0.9, 0.9}};
  const auto one = Reach(goals, 3, 1, options);
  const auto two = Reach(goals, 3, 2, options);
  const auto fewer = Reach(goals, 2, 2, options);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(one[i].sample.track.states, two[i].sample.track.states);
    EXPECT_EQ(one[i].sample.track.joints, two[i].sample.track.joints);
    EXPECT_EQ(one[i].refit.wrist_errors_m, two[i].refit.wrist_errors_m);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(one[i].sample.track.states, fewer[i].sample.track.states);
  }
  EXPECT_NE(one[0].sample.track.states, one[1].sample.track.states);
  options.seed = 2;
  EXPECT_NE(Reach(goals, 1, 1, options)[0].sample.track.states, one[0].sample.track.states);
}

TEST(ReachByOptimization, KeepsTheTimeThatIsGiven) {
  ReachByOptimizationOptions options;
  options.frames = 70;
  options.stay_frames = {20};
  options.latent.lbfgs_iterations = 20;
  const OptimizedReach reach = Reach({{0.3, -0.9, 1.1}}, 1, 1, options)[0];
  EXPECT_EQ(reach.sample.goals[0].due, 70);
  EXPECT_EQ(reach.sample.track.states.cols(), 91);
  // As published a motion ends when the wrist is due.
  options.as_published = true;
  options.vae.iterations = 20;
  const OptimizedReach published = Reach({{0.3, -0.9, 1.1}}, 1, 1, options)[0];
  EXPECT_EQ(published.sample.track.states.cols(), 71);
  EXPECT_EQ(published.sample.goals[0].due, 70);
}

TEST(ReachByOptimization, SaysThatTheNetworkBroke) {
  const wandr::NetworkWeights weights = wandr::testing::WithScaledOutput(
      wandr::testing::SmallNetwork(wandr::IntentionLayout::kFlagged, 3), 1e30F);
  const wandr::Network<float> network(weights);
  ReachByOptimizationOptions options;
  options.latent.lbfgs_iterations = 3;
  const std::vector<Vector3d> goals = {{0.3, -0.5, 1.1}, {0.1, -0.5, 1.1}};
  const wandr::RolloutStart<float> start =
      wandr::StartAtRest(wandr::StandingPose(DefaultBody()),
                         wandr::Normalizer<double>(weights.statistics))
          .Cast<float>();
  const auto reaches = ReachByOptimization(network, DefaultBody(), start, goals, 2, 2, options);
  for (const OptimizedReach& reach : reaches) {
    EXPECT_TRUE(reach.sample.diverged);
    EXPECT_TRUE(reach.sample.track.joints.allFinite()) << "frames up to there";
    EXPECT_EQ(reach.sample.goals.size(), 2u);
    EXPECT_EQ(reach.sample.NumReached(), 0);
  }
}

TEST(ReachByOptimization, RefusesNoGoalsAndNoMotions) {
  EXPECT_THROW(Reach({}, 1, 1), Error);
  EXPECT_THROW(Reach({{0.3, -0.9, 1.1}}, 0, 1), Error);
  EXPECT_THROW(Reach({{0.3, NAN, 1.1}}, 1, 1), Error);
}

}  // namespace
}  // namespace holdfast
