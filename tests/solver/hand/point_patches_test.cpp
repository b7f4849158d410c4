// SPDX-License-Identifier: MIT
#include "solver/hand/hand_evaluation.h"

#include <numeric>
#include <random>

#include <gtest/gtest.h>

namespace holdfast {
namespace {

class PointPatchesTest : public ::testing::Test {
 protected:
  PointPatchesTest() {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> unit(-0.1, 0.1);
    for (double& x : points_.reshaped()) x = unit(random);
    std::iota(ids_.begin(), ids_.end(), 0);
  }

  double LeastOfAll(const Eigen::Vector3d& to) const {
    return (points_.colwise() - to).colwise().norm().minCoeff();
  }

  Eigen::Matrix3Xd points_ = Eigen::Matrix3Xd(3, 5000);
  std::vector<int> ids_ = std::vector<int>(5000);
};

TEST_F(PointPatchesTest, FindsTheLeastWithoutLookingAtAll) {
  const PointPatches patches(points_, ids_);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-0.2, 0.2);
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d to(unit(random), unit(random), unit(random));
    int looked_at = 0;
    const double least = patches.Least([&](int i) {
      ++looked_at;
      return (points_.col(i) - to).norm();
    });
    EXPECT_DOUBLE_EQ(least, LeastOfAll(to));
    EXPECT_LT(looked_at, 3000);
  }
}

TEST_F(PointPatchesTest, StopsAtWhatIsEnoughAndAtWhatIsAsked) {
  const PointPatches patches(points_, ids_);
  const Eigen::Vector3d to(0.3, 0.0, 0.0);
  int looked_at = 0;
  const auto value = [&](int i) {
    ++looked_at;
    return (points_.col(i) - to).norm();
  };
  EXPECT_LT(patches.Least(value, 1.0, 0.5), 0.5);
  EXPECT_LT(looked_at, 100);
  EXPECT_EQ(patches.Least(value, 0.1), 0.1);  // none is nearer
}

TEST_F(PointPatchesTest, VisitsAllThatAreBelowALimitAndFewOthers) {
  const PointPatches patches(points_, ids_);
  for (const double limit : {0.0, 0.02, 0.05}) {
    const Eigen::Vector3d to(0.05, -0.02, 0.03);
    const auto value = [&](int i) { return (points_.col(i) - to).norm(); };
    std::vector<int> visited(5000, 0);
    patches.ForBelow(limit, value, [&](int i) { ++visited[i]; });
    for (int i = 0; i < 5000; ++i) {
      EXPECT_LE(visited[i], 1);
      EXPECT_TRUE(visited[i] == 1 || value(i) >= limit);
    }
    EXPECT_LT(std::accumulate(visited.begin(), visited.end(), 0), 2500);
  }
}

TEST_F(PointPatchesTest, OfSomePointsOrNone) {
  const PointPatches some(points_, {7, 8, 9});
  EXPECT_EQ(some.Ids().size(), 3u);
  EXPECT_EQ(some.Least([](int i) { return static_cast<double>(i); }), 7.0);
  EXPECT_EQ(PointPatches().Least([](int) { return 0.0; }, 3.0), 3.0);
}

}  // namespace
}  // namespace holdfast
