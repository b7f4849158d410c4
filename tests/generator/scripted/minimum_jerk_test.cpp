// SPDX-License-Identifier: MIT
#include "generator/scripted/minimum_jerk.h"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/error.h"

namespace holdfast {
namespace {

Waypoint At(double time_s, double value, bool rest = false) {
  return {time_s, Eigen::VectorXd::Constant(1, value), rest};
}

// Integral of the squared third derivative, by Simpson's rule on each of many short steps.
template <typename Jerk>
double JerkCost(Jerk&& jerk, double begin, double end) {
  constexpr int kSteps = 4000;
  const double h = (end - begin) / kSteps;
  double sum = 0.0;
  for (int k = 0; k < kSteps; ++k) {
    const double a = begin + k * h;
    const auto square = [](double x) { return x * x; };
    sum += h / 6.0 * (square(jerk(a)) + 4.0 * square(jerk(a + 0.5 * h)) + square(jerk(a + h)));
  }
  return sum;
}

TEST(MinimumJerk, RunsFromRestToRestSymmetrically) {
  EXPECT_EQ(MinimumJerk(0.0), 0.0);
  EXPECT_EQ(MinimumJerk(1.0), 1.0);
  EXPECT_EQ(MinimumJerk(-3.0), 0.0);
  EXPECT_EQ(MinimumJerk(7.0), 1.0);
  for (int k = 0; k <= 100; ++k) {
    const double tau = k / 100.0;
    EXPECT_NEAR(MinimumJerk(tau) + MinimumJerk(1.0 - tau), 1.0, 1e-14);
  }
  // Peak speed is 15/8 of the mean speed, at half time (Flash & Hogan 1985).
  EXPECT_NEAR((MinimumJerk(0.5 + 1e-6) - MinimumJerk(0.5 - 1e-6)) / 2e-6, 1.875, 1e-8);
}

TEST(MinimumJerkSpline, TwoPointsGiveThePointToPointMovement) {
  const std::vector<Waypoint> points = {At(1.0, -2.0), At(3.5, 4.0)};
  const MinimumJerkSpline spline(points);
  for (int k = 0; k <= 50; ++k) {
    const double t = 0.5 + 0.08 * k;
    EXPECT_NEAR(spline.Value(t)[0], -2.0 + 6.0 * MinimumJerk((t - 1.0) / 2.5), 1e-12);
  }
}

TEST(MinimumJerkSpline, PassesThroughItsPointsSmoothly) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Waypoint> points;
    double time = 0.0;
    for (int k = 0; k < 6; ++k) {
      Waypoint point{time, Eigen::VectorXd(3), k == 3};
      for (int c = 0; c < 3; ++c) point.value[c] = uniform(random);
      points.push_back(point);
      time += 0.3 + 0.25 * (uniform(random) + 1.0);
    }
    const MinimumJerkSpline spline(points);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double t = points[k].time_s;
      EXPECT_LT((spline.Value(t) - points[k].value).norm(), 1e-12);
      if (k == 0 || k == 3 || k + 1 == points.size()) {
        EXPECT_LT(spline.Derivative(t, 1).norm(), 1e-9);
        EXPECT_LT(spline.Derivative(t, 2).norm(), 1e-8);
        continue;
      }
      // Four continuous derivatives where it passes through.
      for (int order = 1; order <= 4; ++order) {
        const double e = 1e-9;
        const Eigen::VectorXd jump =
            spline.Derivative(t + e, order) - spline.Derivative(t - e, order);
        const double scale =
            1.0 + spline.Derivative(t, order).norm() + 1e-3 * spline.Derivative(t, 5).norm();
        EXPECT_LT(jump.norm(), 1e-5 * scale) << "derivative " << order;
      }
    }
  }
}

TEST(MinimumJerkSpline, NoNearbyCurveHasLessJerk) {
  const std::vector<Waypoint> points = {At(0.0, 0.0), At(0.7, 1.0), At(1.2, 0.4), At(2.0, 2.0)};
  const MinimumJerkSpline spline(points);
  const double least = JerkCost([&](double t) { return spline.Derivative(t, 3)[0]; }, 0.0, 2.0);
  // t^3 (2 - t)^3 (t - 0.7)(t - 1.2) q(t) keeps points and ends; its third derivative numerically.
  for (int power = 0; power < 3; ++power) {
    for (const double size : {-0.05, 0.05}) {
      const auto bump = [&](double t) {
        return size * std::pow(t * (2.0 - t), 3) * (t - 0.7) * (t - 1.2) * std::pow(t, power);
      };
      const auto jerk = [&](double t) {
        const double h = 2e-3;
        return spline.Derivative(t, 3)[0] +
               (bump(t + 2 * h) - 2 * bump(t + h) + 2 * bump(t - h) - bump(t - 2 * h)) /
                   (2 * h * h * h);
      };
      EXPECT_GT(JerkCost(jerk, 0.0, 2.0), least);
    }
  }
}

TEST(MinimumJerkSpline, DerivativesAgreeWithDifferences) {
  const std::vector<Waypoint> points = {At(0.0, 0.0), At(0.5, 1.0), At(1.5, -1.0)};
  const MinimumJerkSpline spline(points);
  for (int order = 1; order <= 5; ++order) {
    for (const double t : {0.1, 0.3, 0.8, 1.2}) {
      const double h = 1e-5;
      const double difference =
          (spline.Derivative(t + h, order - 1)[0] - spline.Derivative(t - h, order - 1)[0]) /
          (2.0 * h);
      const double exact = spline.Derivative(t, order)[0];
      EXPECT_NEAR(difference, exact, 1e-5 * (1.0 + std::abs(exact)));
    }
  }
}

TEST(MinimumJerkSpline, StandsStillOutside) {
  const std::vector<Waypoint> points = {At(1.0, 5.0), At(2.0, 7.0)};
  const MinimumJerkSpline spline(points);
  EXPECT_EQ(spline.Value(-10.0)[0], 5.0);
  EXPECT_EQ(spline.Value(10.0)[0], 7.0);
  EXPECT_EQ(spline.Derivative(10.0, 1)[0], 0.0);
  const std::vector<Waypoint> one = {At(1.0, 5.0)};
  EXPECT_EQ(MinimumJerkSpline(one).Value(0.3)[0], 5.0);
}

TEST(MinimumJerkSpline, RefusesBadWaypoints) {
  EXPECT_THROW(MinimumJerkSpline({}), Error);
  const std::vector<Waypoint> backwards = {At(1.0, 0.0), At(1.0, 1.0)};
  EXPECT_THROW(MinimumJerkSpline{backwards}, Error);
  std::vector<Waypoint> mixed = {At(0.0, 0.0), At(1.0, 1.0)};
  mixed[1].value = Eigen::VectorXd::Zero(2);
  EXPECT_THROW(MinimumJerkSpline{mixed}, Error);
  const std::vector<Waypoint> nan = {At(0.0, std::numeric_limits<double>::quiet_NaN())};
  EXPECT_THROW(MinimumJerkSpline{nan}, Error);
}

}  // namespace
}  // namespace holdfast
