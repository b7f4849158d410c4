// SPDX-License-Identifier: MIT
#include "solver/terms/hand/paper_terms.h"

#include <cmath>
#include <numbers>

#include <ceres/manifold_test_utils.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

Eigen::Quaterniond Turned(const Eigen::Vector3d& w) { return Eigen::Quaterniond(ExpSO3(w)); }

TEST(RotationManifold, KeepsCeressInvariants) {
  const RotationManifold manifold;
  for (const Eigen::Vector3d& w : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1e-9, 0, 0),
                                   Eigen::Vector3d(0.4, -1.1, 2.0), Eigen::Vector3d(0, 3.14, 0)}) {
    const Eigen::Quaterniond q = Turned(w);
    const Eigen::Vector4d x = q.coeffs();
    for (const double size : {1e-9, 1e-3, 1.0}) {
      const Eigen::Vector3d delta = size * Eigen::Vector3d(0.3, -0.5, 0.7);
      Eigen::Vector4d y;
      ASSERT_TRUE(manifold.Plus(x.data(), delta.data(), y.data()));
      EXPECT_THAT(manifold, ceres::XPlusZeroIsXAt(x, 1e-12));
      EXPECT_THAT(manifold, ceres::XMinusXIsZeroAt(x, 1e-12));
      EXPECT_THAT(manifold, ceres::MinusPlusIsIdentityAt(x, delta, 1e-6));
      EXPECT_THAT(manifold, ceres::PlusMinusIsIdentityAt(x, y, 1e-6));
      EXPECT_THAT(manifold, ceres::HasCorrectPlusJacobianAt(x, 1e-7));
      EXPECT_THAT(manifold, ceres::HasCorrectMinusJacobianAt(x, 1e-7));
      // Radians on the right, not half-angles on the left.
      EXPECT_LT(
          (Eigen::Quaterniond(y).toRotationMatrix() - q.toRotationMatrix() * ExpSO3(delta)).norm(),
          1e-12);
    }
  }
}

TEST(Temporal, VanishesWhereNothingMoved) {
  const Eigen::Quaterniond q = Turned({0.2, 0.3, -0.4});
  const Eigen::Vector3d t(1, 2, 3);
  const FingerPose p = FingerPose::Constant(0.2);
  EXPECT_NEAR(Temporal::Energy(q, t, p, q, t, p), 0.0, 1e-15);
}

TEST(Temporal, CountsRadiansMetersAndFingers) {
  const Eigen::Quaterniond q = Turned({0.2, 0.3, -0.4});
  const Eigen::Vector3d t(1, 2, 3);
  const FingerPose p = FingerPose::Zero();
  const Eigen::Quaterniond turned = q * Turned({0, 0.5, 0});
  EXPECT_NEAR(Temporal::Energy(q, t, p, turned, t, p), 0.25, 1e-12);
  EXPECT_NEAR(Temporal::Energy(q, t, p, q, t + Eigen::Vector3d(0, 0.1, 0), p), 0.01, 1e-12);
  EXPECT_NEAR(Temporal::Energy(q, t, p, q, t, FingerPose::Constant(0.1)), 0.45, 1e-12);
}

TEST(Temporal, JacobianMatchesCentralDifferences) {
  const FingerPose previous = FingerPose::LinSpaced(-0.5, 0.5);
  for (const double angle : {0.0, 1e-8, 0.5, 2.0, std::numbers::pi - 1e-3}) {
    const Eigen::Quaterniond before = Turned({0.3, -0.7, 0.2});
    const Temporal term(before, Eigen::Vector3d(0.1, 0.2, 0.3), previous, 0.7);
    Eigen::Quaterniond q = before * Turned(angle * Eigen::Vector3d(1, -2, 0.5).normalized());
    Eigen::Vector3d t(0.4, 0.1, 0.2);
    FingerPose p = FingerPose::LinSpaced(0.1, 0.9);
    const RotationManifold manifold;
    const std::vector<double*> at = {q.coeffs().data(), t.data(), p.data()};
    EXPECT_NEAR(testing::ResidualsAt(term, at.data()).squaredNorm(),
                0.7 * Temporal::Energy(before, {0.1, 0.2, 0.3}, previous, q, t, p), 1e-10);
    EXPECT_LT(testing::JacobianError(term, at, {&manifold}, 1e-6), 1e-6) << angle;
  }
}

}  // namespace
}  // namespace holdfast
