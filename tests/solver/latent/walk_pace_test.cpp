// SPDX-License-Identifier: MIT
#include "solver/latent/walk_pace.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace holdfast {
namespace {

using Eigen::Vector2d;

TEST(WalkPace, GoesStraightToWhereTheGoalIsInReach) {
  const Vector2d from(1.0, 2.0), goal(1.0, 5.0);
  const WalkPace pace(from, Vector2d::UnitY(), goal);
  EXPECT_NEAR(pace.Length(), 2.55, 1e-9);
  EXPECT_NEAR((pace.PelvisAt(0.0) - from).norm(), 0.0, 1e-9);
  EXPECT_LT(pace.Arrival(), pace.Deadline() - 15);
  EXPECT_NEAR((pace.PelvisAt(pace.Arrival()) - Vector2d(1.0, 4.55)).norm(), 0.0, 1e-9);
  for (int t = 0; t < pace.Deadline(); ++t) {
    const Vector2d step = pace.PelvisAt(t + 1) - pace.PelvisAt(t);
    EXPECT_GE(step.y(), -1e-12);
    EXPECT_LE(step.norm() * 30.0, 1.35 + 1e-9);
    EXPECT_NEAR(step.x(), 0.0, 1e-12);
  }
}

TEST(WalkPace, ShortWaysAreSlower) {
  const WalkPace pace(Vector2d::Zero(), Vector2d::UnitX(), Vector2d(0.65, 0.0));
  double fastest = 0.0;
  for (int t = 0; t < pace.Deadline(); ++t) {
    fastest = std::max(fastest, (pace.PelvisAt(t + 1) - pace.PelvisAt(t)).norm() * 30.0);
  }
  EXPECT_NEAR(pace.PelvisAt(pace.Deadline()).x(), 0.2, 1e-9);
  EXPECT_LT(fastest, 0.75);
  EXPECT_GT(fastest, 0.5);
}

TEST(WalkPace, WhoFacesAwayTurnsFirst) {
  const Vector2d goal(3.0, 0.0);
  const WalkPace ahead(Vector2d::Zero(), Vector2d::UnitX(), goal);
  const WalkPace behind(Vector2d::Zero(), -Vector2d::UnitX(), goal);
  const WalkPace beside(Vector2d::Zero(), Vector2d::UnitY(), goal);
  EXPECT_GT(beside.Deadline(), ahead.Deadline());
  EXPECT_GT(behind.Deadline(), beside.Deadline());
  EXPECT_NEAR(behind.PelvisAt(30.0).norm(), 0.0, 1e-9);
  EXPECT_GT(ahead.PelvisAt(30.0).norm(), 0.5);
}

TEST(WalkPace, AtTheGoalThereIsNoWay) {
  const WalkPace pace(Vector2d(1.0, 1.0), Vector2d::UnitX(), Vector2d(1.0, 1.0));
  EXPECT_EQ(pace.Length(), 0.0);
  EXPECT_EQ(pace.Deadline(), 40);
  EXPECT_EQ(pace.PelvisAt(20.0), Vector2d(1.0, 1.0));
}

}  // namespace
}  // namespace holdfast
