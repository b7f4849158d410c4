// SPDX-License-Identifier: MIT
#include "solver/reach/walk_and_reach.h"

#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/wandr/network.h"
#include "geometry/error.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/error_text.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::SizeIs;

ReachPerson Standing() { return StandingPerson(BodyModel::Default()); }

ReachReport Reach(const Eigen::Vector3d& goal, const ReachOptions& options) {
  const std::vector<Eigen::Vector3d> goals = {goal};
  return WalkAndReach(Standing(), wandr::DefaultNetwork(), goals, options);
}

TEST(WalkAndReach, PutsTheWristAtTheGoalAndRanksTheRest) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    ReachOptions options;
    options.side = side;
    options.samples = 4;
    options.threads = 2;
    const ReachPerson person = Standing();
    const Eigen::Vector3d goal(1.5, 1.0, 1.1);
    const ReachReport report = Reach(goal, options);
    ASSERT_FALSE(report.stopped);
    ASSERT_THAT(report.motions, SizeIs(4));
    const ReachMotion& best = report.motions.front();
    ASSERT_TRUE(best.sample.goals[0].Reached());
    EXPECT_FALSE(report.why_missed[0]);
    EXPECT_TRUE(best.refit);
    EXPECT_FALSE(report.motions.back().refit);
    // The refitted wrist is at the goal, in the clip as well.
    BodyState state;
    const Clip clip = ClipOf(best, person);
    const int frame = best.sample.goals[0].closest_frame;
    ForwardJoints(BodySurface(person.body).RestJoints(), clip.pose[frame], clip.trans.col(frame),
                  state);
    EXPECT_LT((state.joints.col(WristJoint(side)) - goal).norm(), 0.002);
  }
}

// Of those that reach the goal and do not crouch twice, the one that moves most as people do.
TEST(WalkAndReach, RanksByHowPeopleMove) {
  ReachOptions options;
  options.refit = false;
  options.samples = 8;
  options.seed = 3;
  const ReachReport report = Reach({-1.0, 1.5, 0.5}, options);
  ASSERT_THAT(report.motions, SizeIs(8));
  ASSERT_GE(report.reach_all, 2);
  for (std::size_t i = 1; i < report.motions.size(); ++i) {
    const ReachMotion &before = report.motions[i - 1], &motion = report.motions[i];
    const auto place = [](const ReachMotion& one) {
      const bool reached = one.sample.NumReached() == 1;
      return std::tuple(!reached, one.quality.crouches_twice,
                        reached ? one.cost : one.quality.closest_sum_m);
    };
    EXPECT_LE(place(before), place(motion)) << i;
  }
  EXPECT_LT(report.motions[0].cost, report.motions[1].cost);
}

TEST(WalkAndReach, SaysWhyAGoalIsMissed) {
  ReachOptions options;
  options.samples = 1;
  EXPECT_THAT(Reach({1.0, -1.0, 2.8}, options).why_missed[0].value_or(""),
              HasSubstr("too high: on flat feet"));
  options.time_s = 1.0;
  EXPECT_THAT(Reach({0.0, -6.0, 1.0}, options).why_missed[0].value_or(""),
              MatchesRegex("out of time: (5\\.9|6\\.0|6\\.1) m in 1\\.0 s.*"));
}

TEST(WalkAndReach, RefusesWhatMakesNoSense) {
  const ReachPerson person = Standing();
  ReachOptions options;
  options.side = Side::kLeft;
  options.obstacles.push_back(
      MakeObstacle("crate", testing::Box({0.9, -0.1, 0.9}, {1.1, 0.1, 1.1}), Side::kLeft, 1));
  const auto refused = [&](const Eigen::Vector3d& goal) {
    return testing::ErrorText([&] { CheckReachGoals({&goal, 1}, person, options); });
  };
  EXPECT_THAT(refused({1, 0, -0.2}), HasSubstr("0.20 m below the ground"));
  EXPECT_THAT(refused({0, 30, 1}), HasSubstr("the maximum is"));
  EXPECT_THAT(refused({1, 0, 1}), HasSubstr("0.10 m inside the obstacle crate"));
  EXPECT_EQ(refused({-1, 0, 1}), "no error");  // not where the mirror has it
}

TEST(WalkAndReach, StopsWhenToldTo) {
  const std::vector<Eigen::Vector3d> goals = {{1.5, 1.0, 1.1}};
  for (const ReachBy by : {ReachBy::kIntention, ReachBy::kLatents}) {
    ReachOptions options;
    options.by = by;
    int calls = 0;
    const ReachReport report = WalkAndReach(Standing(), wandr::DefaultNetwork(), goals, options,
                                            [&](const char*, int, int) {
                                              ++calls;
                                              return false;
                                            });
    EXPECT_TRUE(report.stopped);
    EXPECT_EQ(calls, 1);
  }
}

TEST(ReachPerson, GoesOnFromAFrameAtItsRate) {
  const std::shared_ptr<const BodyModel> body = BodyModel::Default();
  Clip clip;
  clip.frame_rate = 60;
  clip.pose.assign(61, JointPose::Zero());
  clip.trans = Eigen::Matrix3Xd::Zero(3, 61);
  clip.trans.row(0).setLinSpaced(0.0, 6.0);
  const ReachPerson person = PersonInClip(clip, {body, {}}, 40);
  EXPECT_EQ(person.Frame(), 20);
  EXPECT_NEAR(person.Pelvis().x() - PersonInClip(clip, {body, {}}, 0).Pelvis().x(), 4.0, 1e-6);
  EXPECT_EQ(PersonInClip(clip, {body, {}}).Frame(), 30);
  EXPECT_THROW(PersonInClip(clip, {body, {}}, 61), Error);
}

}  // namespace
}  // namespace holdfast
