// SPDX-License-Identifier: MIT
#include "geometry/rotation.h"

#include <numbers>
#include <random>

#include <gtest/gtest.h>
#include <unsupported/Eigen/MatrixFunctions>

namespace holdfast {
namespace {

// Identity, near it, ordinary, near pi, beyond pi.
std::vector<Eigen::Vector3d> Samples() {
  std::mt19937 engine(5);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> samples = {Eigen::Vector3d::Zero()};
  for (const double angle :
       {1e-12, 1e-8, 1e-4, 0.0999, 0.1001, 1.0, 3.0, std::numbers::pi - 1e-7, 4.5}) {
    for (int k = 0; k < 5; ++k) {
      samples.push_back(
          angle * Eigen::Vector3d(normal(engine), normal(engine), normal(engine)).normalized());
    }
  }
  return samples;
}

TEST(Rotation, ExpIsTheMatrixExponential) {
  for (const Eigen::Vector3d& w : Samples()) {
    const Eigen::Matrix3d expected = Skew(w).exp();
    EXPECT_LT((ExpSO3(w) - expected).norm(), 1e-14 * (1.0 + w.norm())) << w.transpose();
  }
}

TEST(Rotation, LogUndoesExpUpToWholeTurns) {
  for (const Eigen::Vector3d& w : Samples()) {
    const Eigen::Vector3d log = LogSO3(ExpSO3(w));
    EXPECT_LE(log.norm(), std::numbers::pi + 1e-12);
    EXPECT_LT((ExpSO3(log) - ExpSO3(w)).norm(), 1e-14 * 10) << w.transpose();
    if (w.norm() < 3.1) {
      EXPECT_LT((log - w).norm(), 1e-12) << w.transpose();
    }
  }
}

TEST(Rotation, LeftJacobianMatchesDifferences) {
  for (const Eigen::Vector3d& w : Samples()) {
    const Eigen::Matrix3d J = LeftJacobianSO3(w);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d h = 1e-6 * Eigen::Vector3d::Unit(k);
      const Eigen::Vector3d numeric = LogSO3(ExpSO3(w + h) * ExpSO3(w - h).transpose()) / 2e-6;
      EXPECT_LT((J.col(k) - numeric).norm(), 1e-9) << w.transpose();
    }
    if (w.norm() < 6.0) {
      EXPECT_LT((InverseLeftJacobianSO3(w) * J - Eigen::Matrix3d::Identity()).norm(), 1e-12)
          << w.transpose();
    }
  }
}

TEST(Rotation, NearestRotationIsARotationAndLeavesRotationsAlone) {
  std::srand(3);
  for (int k = 0; k < 50; ++k) {
    const Eigen::Matrix3d M = Eigen::Matrix3d::Random();
    const Eigen::Matrix3d R = NearestRotation(M);
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-13);
    EXPECT_NEAR(R.determinant(), 1.0, 1e-13);
    for (const Eigen::Vector3d& w : {Eigen::Vector3d(1e-3, 0, 0), Eigen::Vector3d(0, 1e-3, 0)}) {
      EXPECT_LE((R - M).norm(), (ExpSO3(w) * R - M).norm() + 1e-12);
    }
  }
  const Eigen::Matrix3d rotation = ExpSO3({0.3, -2.0, 0.7});
  EXPECT_LT((NearestRotation(rotation) - rotation).norm(), 1e-14);
}

TEST(Rotation, UnwrapFollowsATurnBeyondPi) {
  Eigen::Vector3d previous = Eigen::Vector3d::Zero();
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 3).normalized();
  for (double angle = 0.0; angle < 12.0; angle += 0.1) {
    const Eigen::Vector3d w = UnwrapAxisAngle(LogSO3(ExpSO3(angle * axis)), previous);
    EXPECT_LT((w - angle * axis).norm(), 1e-9);
    previous = w;
  }
}

}  // namespace
}  // namespace holdfast
