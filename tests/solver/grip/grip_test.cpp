// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "solver/grip/grip.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

TEST(BalancePresses, OpposedContactsPushAlikeAndSumToTheGrip) {
  std::vector<GripContact> contacts(3);
  contacts[0] = {1, {-0.02, 0.01, 0.0}, {1.0, 0.0, 0.0}, Eigen::Vector3d::Zero()};
  contacts[1] = {2, {-0.02, -0.01, 0.0}, {1.0, 0.0, 0.0}, Eigen::Vector3d::Zero()};
  contacts[2] = {3, {0.02, 0.0, 0.0}, {-1.0, 0.0, 0.0}, Eigen::Vector3d::Zero()};
  BalancePresses(Eigen::Vector3d::Zero(), 0.03, 0.5, 12.0, contacts);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double pushes = 0.0;
  for (const GripContact& contact : contacts) {
    sum += contact.press;
    pushes += contact.press.dot(contact.into);
  }
  EXPECT_NEAR(pushes, 12.0, 1e-9);
  EXPECT_LT(sum.norm(), 0.2);
  EXPECT_NEAR(contacts[2].press.dot(contacts[2].into), 6.0, 0.1);
}

TEST(SqueezeDual, JacobianMatchesDifferences) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  SqueezeDual::Wrenches wrenches(6, 12);
  for (double& w : wrenches.reshaped()) w = normal(random);
  const SqueezeDual term(wrenches, 100.0);
  Eigen::Matrix<double, 6, 1> y = 0.2 * wrenches.col(0);
  EXPECT_LT(testing::JacobianError(term, {y.data()}), 1e-6);
}

// The forces of the documented sum of squares, one coordinate at a time.
void PressOneAfterAnother(double radius_m, double friction, std::vector<GripContact>& contacts) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> w(6, 4 * std::ssize(contacts));
  for (Eigen::Index g = 0; g < w.cols(); ++g) {
    const GripContact& contact = contacts[g / 4];
    const Eigen::Vector3d side = contact.into.unitOrthogonal(), up = contact.into.cross(side);
    const double angle = 0.5 * std::numbers::pi * static_cast<double>(g % 4);
    const Eigen::Vector3d force =
        contact.into + friction * (std::cos(angle) * side + std::sin(angle) * up);
    w.col(g) << force, contact.point.cross(force) / radius_m;
  }
  Eigen::VectorXd f = Eigen::VectorXd::Constant(w.cols(), 0.25);
  Eigen::Matrix<double, 6, 1> sum = w * f;
  for (int sweep = 0; sweep < 100000; ++sweep) {
    for (Eigen::Index g = 0; g < f.size(); ++g) {
      sum -= f[g] * w.col(g);
      f[g] = std::max(0.0,
                      (0.25 - 100.0 * w.col(g).dot(sum)) / (100.0 * w.col(g).squaredNorm() + 1.0));
      sum += f[g] * w.col(g);
    }
  }
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const auto begin = static_cast<Eigen::Index>(4 * c);
    contacts[c].press = w.topRows<3>().middleCols<4>(begin) * f.segment<4>(begin) / f.sum();
  }
}

TEST(BalancePresses, IsTheLeastOverForcesThatPush) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (const int count : {2, 3, 5, 9}) {
    std::vector<GripContact> contacts(static_cast<std::size_t>(count));
    for (GripContact& contact : contacts) {
      const auto draw = [&] {
        return Eigen::Vector3d(normal(random), normal(random), normal(random));
      };
      contact.into = draw().normalized();
      contact.point = -0.03 * contact.into + 0.005 * draw();
    }
    std::vector<GripContact> expected = contacts;
    BalancePresses(Eigen::Vector3d::Zero(), 0.03, 0.5, 1.0, contacts);
    PressOneAfterAnother(0.03, 0.5, expected);
    for (std::size_t c = 0; c < contacts.size(); ++c) {
      EXPECT_LT((contacts[c].press - expected[c].press).norm(), 1e-5) << count << " " << c;
    }
  }
}

// Two jaws along x, each on a spring of its own, that press with `press_N`.
double GiveBetweenJaws(double press_N, const GripGiveOptions& options) {
  std::vector<GripContact> contacts(2);
  contacts[0] = {0, {-0.02, 0.0, 0.0}, {1.0, 0.0, 0.0}, {press_N, 0.0, 0.0}};
  contacts[1] = {1, {0.02, 0.0, 0.0}, {-1.0, 0.0, 0.0}, {-press_N, 0.0, 0.0}};
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(6, 2);
  slopes(0, 0) = slopes(3, 1) = 1.0;
  const GrippedSolid solid{Eigen::Vector3d::Zero(), 0.03, 0.1};
  return GripGive(contacts, slopes, Eigen::Vector2d::Constant(500.0), solid, options);
}

TEST(GripGive, IsTheWeightOverTheSpringsInSeries) {
  const GripGiveOptions options{.friction = 0.5, .pad_stiffness_N_m = 2000.0};
  // Along x jaws and pads give, across it the pads alone: x is the worst.
  const double stiffness = 2.0 / (1.0 / 500.0 + 1.0 / 2000.0);
  const double expected = 0.1 * options.gravity_m_s2 / stiffness;
  EXPECT_NEAR(GiveBetweenJaws(5.0, options), expected, 0.02 * expected);
}

TEST(GripGive, FallsWhereFrictionCarriesLessThanTheWeight) {
  const GripGiveOptions options{.friction = 0.5};
  EXPECT_LT(GiveBetweenJaws(1.2, options), 0.005);  // carries 1.2 N of 0.98 N
  EXPECT_GT(GiveBetweenJaws(0.8, options), 0.02);   // 0.8 N
  EXPECT_GT(GiveBetweenJaws(0.4, options), 0.1);
}

// While nothing slides or parts, the hand is a spring: 6 x 6.
TEST(GripGive, IsThatOfALinearSpringWhileNothingSlides) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto vector = [&] {
    return Eigen::Vector3d(normal(random), normal(random), normal(random));
  };
  for (int trial = 0; trial < 5; ++trial) {
    std::vector<GripContact> contacts(6);
    const GrippedSolid solid{0.01 * vector(), 0.06, 0.2};
    const GripGiveOptions options{.friction = 3.0};
    Eigen::Matrix<double, 6, Eigen::Dynamic> wrenches(6, 18);
    for (int c = 0; c < 6; ++c) {
      // A press at each and its opposite: balanced.
      GripContact& contact = contacts[c];
      contact.into = c % 2 == 0 ? vector().normalized() : Eigen::Vector3d(-contacts[c - 1].into);
      contact.point = c % 2 == 0
                          ? Eigen::Vector3d(0.03 * vector())
                          : Eigen::Vector3d(contacts[c - 1].point + 0.05 * contacts[c - 1].into);
      contact.press = 100.0 * contact.into;
      const Eigen::Vector3d arm = (contact.point - solid.center) / solid.radius_m;
      for (int k = 0; k < 3; ++k) {
        wrenches.col(3 * c + k) << Eigen::Vector3d::Unit(k), arm.cross(Eigen::Vector3d::Unit(k));
      }
    }
    Eigen::MatrixXd slopes(18, 7);
    for (double& slope : slopes.reshaped()) slope = 0.05 * normal(random);
    const Eigen::VectorXd stiffness = Eigen::VectorXd::Constant(7, 3.0);
    const Eigen::MatrixXd compliance =
        slopes * slopes.transpose() / 3.0 +
        Eigen::MatrixXd::Identity(18, 18) / options.pad_stiffness_N_m;
    const Eigen::Matrix<double, 6, 6> spring =
        wrenches * compliance.inverse() * wrenches.transpose();
    double worst = 0.0;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Matrix<double, 6, 1> load =
          solid.mass_kg * options.gravity_m_s2 * Eigen::Matrix<double, 6, 1>::Unit(k);
      const Eigen::Matrix<double, 6, 1> moved = spring.ldlt().solve(load);
      worst = std::max(worst, moved.head<3>().norm() + moved.tail<3>().norm());
    }
    EXPECT_NEAR(GripGive(contacts, slopes, stiffness, solid, options), worst, 0.05 * worst);
  }
}

TEST(GripGive, WithoutContactsNothingHolds) {
  EXPECT_GT(GripGive({}, Eigen::MatrixXd(0, 4), Eigen::VectorXd::Ones(4), {}), 0.1);
}

}  // namespace
}  // namespace holdfast
