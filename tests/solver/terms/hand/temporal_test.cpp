// SPDX-License-Identifier: MIT
#include "solver/terms/hand/paper_terms.h"

#include <cmath>
#include <numbers>

#include <ceres/manifold_test_utils.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
    const Eigen::Quaterniond q = before * Turned(angle * Eigen::Vector3d(1, -2, 0.5).normalized());
    const Eigen::Vector3d t(0.4, 0.1, 0.2);
    const FingerPose p = FingerPose::LinSpaced(0.1, 0.9);
    const double* parameters[] = {q.coeffs().data(), t.data(), p.data()};
    Eigen::Matrix<double, 51, 1> r = Eigen::Matrix<double, 51, 1>::Constant(NAN);
    Eigen::Matrix<double, 51, 4, Eigen::RowMajor> J_q;
    Eigen::Matrix<double, 51, 3, Eigen::RowMajor> J_t;
    Eigen::Matrix<double, 51, kHandDofs, Eigen::RowMajor> J_p;
    J_q.setConstant(NAN), J_t.setConstant(NAN), J_p.setConstant(NAN);
    double* jacobians[] = {J_q.data(), J_t.data(), J_p.data()};
    ASSERT_TRUE(term.Evaluate(parameters, r.data(), jacobians));
    EXPECT_NEAR(r.squaredNorm(), 0.7 * Temporal::Energy(before, {0.1, 0.2, 0.3}, previous, q, t, p),
                1e-10);
    Eigen::MatrixXd J(51, 51);
    J << J_q * RotationManifold::PlusJacobianAt(parameters[0]), J_t, J_p;
    const RotationManifold manifold;
    const double h = 1e-6;
    for (int k = 0; k < 51; ++k) {
      Eigen::Matrix<double, 51, 1> ends[2];
      for (int sign = 0; sign < 2; ++sign) {
        const double step = sign == 0 ? h : -h;
        Eigen::Quaterniond qs = q;
        Eigen::Vector3d ts = t;
        FingerPose ps = p;
        if (k < 3) {
          const Eigen::Vector3d delta = step * Eigen::Vector3d::Unit(k);
          manifold.Plus(q.coeffs().data(), delta.data(), qs.coeffs().data());
        } else if (k < 6) {
          ts(k - 3) += step;
        } else {
          ps(k - 6) += step;
        }
        const double* moved[] = {qs.coeffs().data(), ts.data(), ps.data()};
        ASSERT_TRUE(term.Evaluate(moved, ends[sign].data(), nullptr));
      }
      EXPECT_LT((J.col(k) - (ends[0] - ends[1]) / (2 * h)).norm(), 1e-6) << k << " " << angle;
    }
  }
}

}  // namespace
}  // namespace holdfast
