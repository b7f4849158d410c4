// SPDX-License-Identifier: MIT
#include "generator/wandr/walk_pace.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace holdfast::wandr {
namespace {

using Eigen::Vector2d;

TEST(WalkPace, GoesStraightToWhereTheGoalIsInReach) {
  const Vector2d from(1.0, 2.0), goal(1.0, 5.0);
  const WalkPace pace(from, Vector2d::UnitY(), Vector2d::Zero(), goal);
  EXPECT_NEAR((pace.At(0.0).position - from).norm(), 0.0, 1e-9);
  EXPECT_LT(pace.Arrival(), pace.Deadline() - 12);
  EXPECT_NEAR((pace.At(pace.Arrival()).position - Vector2d(1.0, 4.55)).norm(), 0.0, 0.04);
  for (int t = 0; t < pace.Deadline(); ++t) {
    const Vector2d step = pace.At(t + 1).position - pace.At(t).position;
    EXPECT_GE(step.y(), -1e-12);
    EXPECT_LE(step.norm() * 30.0, 1.55 + 1e-9);
    EXPECT_NEAR(step.x(), 0.0, 1e-9);
  }
}

TEST(WalkPace, ShortWaysAreSlower) {
  const WalkPace pace(Vector2d::Zero(), Vector2d::UnitX(), Vector2d::Zero(), Vector2d(0.65, 0.0));
  double fastest = 0.0;
  for (int t = 0; t < pace.Deadline(); ++t) {
    fastest = std::max(fastest, (pace.At(t + 1).position - pace.At(t).position).norm() * 30.0);
  }
  EXPECT_NEAR(pace.At(pace.Deadline()).position.x(), 0.2, 0.04);
  EXPECT_LT(fastest, 0.9);
  EXPECT_GT(fastest, 0.4);
}

TEST(WalkPace, WhoFacesAwayTurnsWhileSettingOff) {
  const Vector2d goal(3.0, 0.0);
  const WalkPace ahead(Vector2d::Zero(), Vector2d::UnitX(), Vector2d::Zero(), goal);
  const WalkPace behind(Vector2d::Zero(), -Vector2d::UnitX(), Vector2d::Zero(), goal);
  const WalkPace beside(Vector2d::Zero(), Vector2d::UnitY(), Vector2d::Zero(), goal);
  EXPECT_GT(beside.Deadline(), ahead.Deadline());
  EXPECT_GT(behind.Deadline(), beside.Deadline());
  EXPECT_GT(behind.At(30.0).position.norm(), 0.05);
  EXPECT_GT(ahead.At(30.0).position.norm(), 2.0 * behind.At(30.0).position.norm());
  for (int t = 0; t < behind.Deadline(); ++t) {
    const Vector2d now = behind.At(t).facing, next = behind.At(t + 1).facing;
    EXPECT_LT(std::acos(std::min(1.0, now.dot(next))) * 30.0, 1.25);
  }
}

TEST(WalkPace, AtTheGoalThereIsNoWay) {
  const WalkPace pace(Vector2d(1.0, 1.0), Vector2d::UnitX(), Vector2d::Zero(), Vector2d(1.0, 1.0));
  EXPECT_EQ(pace.Deadline(), 40);
  EXPECT_EQ(pace.At(20.0).position, Vector2d(1.0, 1.0));
}

TEST(WalkPace, WhoWalksWalksOn) {
  const Vector2d goal(3.0, 0.0), ahead = Vector2d::UnitX();
  const WalkPace stands(Vector2d::Zero(), ahead, Vector2d::Zero(), goal);
  const WalkPace walks(Vector2d::Zero(), ahead, 1.2 * ahead, goal);
  EXPECT_LT(walks.Deadline(), stands.Deadline());
  EXPECT_GT(walks.At(5.0).position.x(), 5.0 * 1.2 / 30.0);
}

}  // namespace
}  // namespace holdfast::wandr
