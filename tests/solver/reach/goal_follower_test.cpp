// SPDX-License-Identifier: MIT
#include "solver/reach/goal_follower.h"

#include <fstream>

#include <gtest/gtest.h>

#include "generator/wandr/network.h"
#include "geometry/error.h"
#include "solver/reach/goal_track.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

FollowOptions Small(Side side = Side::kRight) {
  return {.side = side, .candidates = 8, .horizon = 8};
}

Vector3d Circling(int frame) {
  const double angle = frame / 60.0;
  return {0.8 * std::sin(angle), -0.6 - 0.8 * (1.0 - std::cos(angle)), 1.1};
}

class FollowedGoal : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!wandr::HasDefaultNetwork()) GTEST_SKIP() << "built without networks";
    network = wandr::DefaultNetwork();
  }

  ReachPerson person = StandingPerson(BodyModel::Default());
  wandr::NetworkWeights network;
};

TEST_F(FollowedGoal, APoseDependsOnGoalsUpToItAlone) {
  GoalFollower one(person, network, Small()), other(person, network, Small());
  for (int t = 0; t < 40; ++t) {
    const Vector3d goal = Circling(t);
    const auto a = wandr::StateOf(one.Step(goal));
    // The other's future turns away from frame 30 on.
    const Vector3d turned(-goal.x(), -goal.y(), goal.z());
    const auto b = wandr::StateOf(other.Step(t < 30 ? goal : turned));
    if (t < 30) {
      EXPECT_EQ(a, b) << t;
    }
    if (t == 39) {
      EXPECT_GT((a - b).norm(), 0.01);
    }
  }
}

TEST_F(FollowedGoal, TheHandIsAtAGoalThatMovesSlowly) {
  std::vector<Vector3d> goals;
  for (int t = 0; t < 120; ++t) goals.push_back(Circling(t));
  const FollowReport report = FollowTrack(person, network, goals, {}, {});
  EXPECT_LT(report.mean_m, 0.08);
  EXPECT_GT(report.lowest_pelvis_m, 0.6);
  EXPECT_GT(report.lowest_foot_m, -0.03);
  EXPECT_EQ(report.track.states.cols(), 121);
}

TEST_F(FollowedGoal, PeopleStepAfterASlowGoalAndDoNotLean) {
  std::vector<Vector3d> goals;
  for (int t = 0; t < 240; ++t)
    goals.emplace_back(0.0, -0.6 - 0.25 * std::max(0, t - 30) / 30.0, 1.3);
  const FollowReport report = FollowTrack(person, network, goals, {}, {});
  EXPECT_LT(report.worst_m, 0.3);  // a person who waits and leans loses the goal by a meter
  const auto& joints = report.track.joints;
  for (Eigen::Index t = 0; t < joints.cols(); ++t) {
    const Eigen::Vector3f feet =
        0.5f * (joints.block<3, 1>(3 * kLeftAnkle, t) + joints.block<3, 1>(3 * kRightAnkle, t));
    const Eigen::Vector3f body = joints.block<3, 1>(3 * kNeck, t) - feet;
    EXPECT_GT(body.z(), 0.88f * body.norm()) << t;  // 28 degrees
  }
}

TEST_F(FollowedGoal, PeopleCrouchForALowGoal) {
  const std::vector<Vector3d> goals(120, Vector3d(0.2, -0.6, 0.25));
  const FollowReport report = FollowTrack(person, network, goals, {}, {});
  EXPECT_LT(report.distance_m.back(), 0.03);
  EXPECT_LT(report.lowest_pelvis_m, 0.6);
}

TEST_F(FollowedGoal, AnArmIsRaisedWhenTheGoalComesIntoReach) {
  const std::vector<Vector3d> goals(240, Vector3d(0.5, -3.5, 1.2));
  const FollowReport report = FollowTrack(person, network, goals, {}, {});
  const auto height = [&](int frame) {
    return report.track.joints(3 * kRightWrist + 2, frame) -
           report.track.joints(3 * kRightShoulder + 2, frame);
  };
  // On the way the arm swings, and nobody leans far; then the hand is there.
  for (int t = 15; report.distance_m[t] > 1.8; ++t) {
    EXPECT_LT(height(t), -0.15) << t;
    const Eigen::Vector3f trunk =
        report.track.joints.block<3, 1>(3 * kNeck, t) - report.track.joints.block<3, 1>(0, t);
    EXPECT_GT(trunk.z(), 0.9f * trunk.norm()) << t;
  }
  EXPECT_LT(report.distance_m.back(), 0.03);
  EXPECT_LT(report.skating, 0.15);
}

TEST_F(FollowedGoal, TheLeftHandFollowsInTheMirror) {
  std::vector<Vector3d> goals;
  for (int t = 0; t < 60; ++t) goals.emplace_back(0.2, -0.45 - 0.002 * t, 1.1);
  const FollowReport report = FollowTrack(person, network, goals, {}, Small(Side::kLeft));
  EXPECT_LT(report.mean_m, 0.08);
}

TEST_F(FollowedGoal, JumpsAndPushesAreSurvived) {
  std::vector<Vector3d> goals;
  for (int t = 0; t < 150; ++t) goals.emplace_back(t < 50 ? 0.0 : 0.9, -0.6, 1.1);
  const std::vector<TrackPush> pushes = {{100, {0.0, 0.3, 0.0}}};
  const FollowReport report = FollowTrack(person, network, goals, pushes, {});
  EXPECT_TRUE(report.track.joints.allFinite());
  EXPECT_GT(report.lowest_pelvis_m, 0.5);
  EXPECT_GT(report.lowest_foot_m, -0.03);
  EXPECT_LT(report.distance_m.back(), 0.10);
}

TEST_F(FollowedGoal, WhatIsStoppedIsTheSameUntilThen) {
  std::vector<Vector3d> goals;
  for (int t = 0; t < 20; ++t) goals.push_back(Circling(t));
  const FollowReport all = FollowTrack(person, network, goals, {}, Small());
  const FollowReport part =
      FollowTrack(person, network, goals, {}, Small(), [](int done, int) { return done < 12; });
  EXPECT_TRUE(part.stopped);
  EXPECT_FALSE(all.stopped);
  ASSERT_EQ(part.distance_m.size(), 12u);
  ASSERT_EQ(part.track.states.cols(), 13);
  EXPECT_EQ(part.track.states, all.track.states.leftCols(13));
  EXPECT_EQ(part.distance_m,
            std::vector<double>(all.distance_m.begin(), all.distance_m.begin() + 12));
  const FollowReport none =
      FollowTrack(person, network, goals, {}, Small(), [](int, int) { return false; });
  EXPECT_TRUE(none.stopped);
  EXPECT_TRUE(none.distance_m.empty());
}

TEST_F(FollowedGoal, BadGoalsAndPushesAreNamed) {
  GoalFollower follower(person, network, Small());
  EXPECT_THROW(follower.Step({0, 0, -1}), Error);
  EXPECT_THROW(follower.Step({30, 0, 1}), Error);
  EXPECT_THROW(follower.Step({NAN, 0, 1}), Error);
  EXPECT_THROW(follower.Push({2, 0, 0}), Error);
  EXPECT_THROW(GoalFollower(person, network, {.candidates = 0}), Error);
  EXPECT_THROW(ParsePush("5,1,2"), Error);
  EXPECT_THROW(ParsePush("-5,1,2,0"), Error);
  EXPECT_EQ(ParsePush("5,0.1,-0.2,0").frame, 5);
}

class GoalTable : public ::testing::Test {
 protected:
  std::vector<Vector3d> Read(const std::string& text, std::optional<double> rate = {}) {
    const auto file = folder.Path() / "goals.csv";
    std::ofstream(file) << text;
    return ReadGoalTrack(file, rate);
  }
  std::string Complaint(const std::string& text) {
    return testing::ErrorText([&] { Read(text); });
  }
  testing::TemporaryFolder folder;
};

TEST_F(GoalTable, HasALineForEachFrame) {
  const auto goals = Read("1,2,1.1\n1.5, 2 ,1.2\r\n\n2,2,1.3\n");
  ASSERT_EQ(goals.size(), 3u);
  EXPECT_EQ(goals[1], Vector3d(1.5, 2, 1.2));
  EXPECT_EQ(Read("z,x,y\n1,2,3\n")[0], Vector3d(2, 3, 1));
}

TEST_F(GoalTable, OfAnotherRateHoldsTheGoalThatCameLast) {
  const auto goals = Read("time,x,y,z\n0,0,0,1\n0.1,1,0,1\n0.2,2,0,1\n");
  ASSERT_EQ(goals.size(), 9u);
  for (int t = 0; t < 9; ++t) EXPECT_EQ(goals[t].x(), t / 3) << t;
  EXPECT_EQ(Read("0,0,1\n1,0,1\n", 15.0).size(), 4u);
  EXPECT_EQ(Read("0,0,1\n1,0,1\n2,0,1\n3,0,1\n", 60.0).size(), 2u);
}

TEST_F(GoalTable, FaultsAreNamedByLine) {
  EXPECT_NE(Complaint("1,2,1\n1,abc,1\n").find("goals.csv:2"), std::string::npos);
  EXPECT_NE(Complaint("1,2\n").find("column 3"), std::string::npos);
  EXPECT_NE(Complaint("x,y\n1,2\n").find("has no column z"), std::string::npos);
  EXPECT_NE(Complaint("1,2,-1\n").find("below the ground"), std::string::npos);
  EXPECT_NE(Complaint("1,0,0,1\n1,0,0,1\n").find("is not after"), std::string::npos);
  EXPECT_NE(Complaint("0,0,0,1\n9e9,0,0,1\n").find("an hour"), std::string::npos);
  EXPECT_NE(Complaint("x,y,z\n").find("has no goals"), std::string::npos);
}

}  // namespace
}  // namespace holdfast
