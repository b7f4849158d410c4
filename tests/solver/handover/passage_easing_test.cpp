// SPDX-License-Identifier: MIT
#include "solver/handover/passage_clearance.h"

#include <gtest/gtest.h>

namespace holdfast {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr int kFrames = 24;
const auto kNothingInTheWay = [](int, const Vector3d&) { return true; };

Vector3d Along(int k) { return {0.02 * k, 0.0, 1.0}; }
Matrix3Xd Straight() {
  Matrix3Xd way(3, kFrames);
  for (int k = 0; k < kFrames; ++k) way.col(k) = Along(k);
  return way;
}
WayEnds EndsOfStraight() { return {Along(-2), Along(-1), Along(kFrames), Along(kFrames + 1)}; }

// There and back within few frames.
Matrix3Xd Detour(double height) {
  Matrix3Xd way = Straight();
  for (int k = 10; k < 14; ++k) way(1, k) += height;
  return way;
}

double Bend(const Matrix3Xd& way, const WayEnds& ends) {
  Matrix3Xd all(3, way.cols() + 4);
  all << *ends[0], *ends[1], way, *ends[2], *ends[3];
  double sum = 0.0;
  for (Eigen::Index k = 1; k + 1 < all.cols(); ++k) {
    sum += (all.col(k - 1) - 2.0 * all.col(k) + all.col(k + 1)).norm();
  }
  return sum;
}

TEST(EasedWay, KeepsAStraightWay) {
  const Matrix3Xd eased = EasedWay(Straight(), EndsOfStraight(), kNothingInTheWay);
  EXPECT_LT((eased - Straight()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(EasedWay, TakesTheAccelerationOutOfADetour) {
  const Matrix3Xd way = Detour(0.1);
  const Matrix3Xd eased = EasedWay(way, EndsOfStraight(), kNothingInTheWay);
  EXPECT_LT(Bend(eased, EndsOfStraight()), 0.2 * Bend(way, EndsOfStraight()));
}

TEST(EasedWay, GoesAroundWhatIsInTheWay) {
  const Matrix3Xd way = Detour(0.1);
  const auto is_clear = [](int k, const Vector3d& x) { return k < 11 || k > 12 || x.y() > 0.08; };
  const Matrix3Xd eased = EasedWay(way, EndsOfStraight(), is_clear);
  for (int k = 0; k < kFrames; ++k) EXPECT_TRUE(is_clear(k, eased.col(k))) << k;
  EXPECT_LT(Bend(eased, EndsOfStraight()), 0.6 * Bend(way, EndsOfStraight()));
}

TEST(EasedWay, ComesBackAsItIsWhereNothingElseIsClear) {
  const Matrix3Xd way = Detour(0.1);
  EXPECT_EQ(EasedWay(way, EndsOfStraight(), [](int, const Vector3d&) { return false; }), way);
}

TEST(EasedWay, NeedsNothingBeyondTheEndsOfAClip) {
  const Matrix3Xd way = Detour(0.1);
  for (const WayEnds& ends : {WayEnds{}, WayEnds{std::nullopt, Along(-1)}}) {
    EXPECT_TRUE(EasedWay(way, ends, kNothingInTheWay).allFinite());
  }
  const Matrix3Xd one = way.leftCols<1>();
  EXPECT_TRUE(EasedWay(one, {}, kNothingInTheWay).isApprox(one));
  EXPECT_EQ(EasedWay(Matrix3Xd(3, 0), EndsOfStraight(), kNothingInTheWay).cols(), 0);
}

}  // namespace
}  // namespace holdfast
