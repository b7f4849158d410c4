// SPDX-License-Identifier: MIT
#include "solver/unknowns/dense_problem.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "solver/terms/hand/paper_terms.h"
#include "solver/terms/motion/goal_terms.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/rotation_manifold.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

struct Unknowns {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d T = Eigen::Vector3d::Zero();
  FingerPose fingers = FingerPose::Zero();
};

TEST(DenseProblem, RowsOfSeveralTermsMeetBetweenTheirGoals) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitY()));
  const FingerPose goal = FingerPose::LinSpaced(-0.5, 0.5);
  const Temporal temporal(turn, {1.0, 2.0, 3.0}, goal, 1.0);
  const NearPoint fingers(FingerPose::Zero(), 3.0);
  Unknowns x;
  DenseProblem problem;
  problem.AddParameterBlock(x.fingers.data(), kHandDofs);
  problem.AddParameterBlock(x.q.coeffs().data(), 4, true);
  problem.AddParameterBlock(x.T.data(), 3);
  problem.AddResidualBlock(temporal, {x.q.coeffs().data(), x.T.data(), x.fingers.data()});
  problem.AddResidualBlock(fingers, {x.fingers.data()});
  const ceres::Solver::Summary summary = problem.Solve(DenseOptions(50, 1e-12, 1e-12));
  EXPECT_TRUE(summary.IsSolutionUsable()) << summary.BriefReport();
  EXPECT_LT(x.q.angularDistance(turn), 1e-6);
  EXPECT_TRUE(x.T.isApprox(Eigen::Vector3d(1.0, 2.0, 3.0), 1e-6));
  EXPECT_TRUE(x.fingers.isApprox(0.25 * goal, 1e-6));
  EXPECT_NEAR(summary.final_cost, 0.5 * 0.75 * goal.squaredNorm(), 1e-9);
}

TEST(DenseProblem, BlocksThatWereNotAddedStay) {
  const ObjectData data({Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}}, 1.0);
  Unknowns x;
  x.q = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX());
  DenseProblem problem;
  problem.AddParameterBlock(x.T.data(), 3);
  problem.AddResidualBlock(data, {x.q.coeffs().data(), x.T.data()});
  EXPECT_TRUE(problem.Solve(DenseOptions(50, 1e-8, 1e-12)).IsSolutionUsable());
  EXPECT_NEAR(x.T.x(), 1.0, 1e-6);
  EXPECT_EQ(x.q.x(), std::sin(0.15));
}

// A block that is added after a term of it is an unknown of that term.
TEST(DenseProblem, TheOrderOfBlocksAndTermsDoesNotMatter) {
  const ObjectData data({Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}}, 1.0);
  Unknowns x;
  x.q = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX());
  DenseProblem problem;
  problem.AddResidualBlock(data, {x.q.coeffs().data(), x.T.data()});
  problem.AddParameterBlock(x.T.data(), 3);
  problem.AddParameterBlock(x.q.coeffs().data(), 4, true);
  EXPECT_TRUE(problem.Solve(DenseOptions(50, 1e-10, 1e-12)).IsSolutionUsable());
  EXPECT_NEAR(x.T.x(), 1.0, 1e-6);
  EXPECT_LT(x.q.angularDistance(Eigen::Quaterniond::Identity()), 1e-6);
}

// x^2 - 2: from 0.1 the first step leads too far, so that some are rejected.
class Root final : public ceres::CostFunction {
 public:
  Root() {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->push_back(1);
  }
  bool Evaluate(double const* const* p, double* residuals, double** jacobians) const override {
    residuals[0] = p[0][0] * p[0][0] - 2.0;
    if (jacobians != nullptr && jacobians[0] != nullptr) jacobians[0][0] = 2.0 * p[0][0];
    return true;
  }
};

TEST(DenseProblem, SolvesAgainFromWhereParametersWerePut) {
  const Root root;
  double x = 0.1;
  DenseProblem problem;
  problem.AddParameterBlock(&x, 1);
  problem.AddResidualBlock(root, {&x});
  const ceres::Solver::Summary summary = problem.Solve(DenseOptions(50, 1e-10, 1e-12));
  EXPECT_TRUE(summary.IsSolutionUsable()) << summary.BriefReport();
  EXPECT_NEAR(x, std::sqrt(2.0), 1e-6);
  EXPECT_GT(StepsOf(summary), 3);
  EXPECT_EQ(StepsOf(summary), summary.num_successful_steps + summary.num_unsuccessful_steps - 1);
  x = 0.1;
  EXPECT_EQ(problem.Solve(DenseOptions(1, 1e-10, 1e-12)).termination_type, ceres::NO_CONVERGENCE);
}

TEST(DenseProblem, FailsWhereTheCostIsNotFinite) {
  const Root root;
  double x = std::numeric_limits<double>::quiet_NaN();
  DenseProblem problem;
  problem.AddParameterBlock(&x, 1);
  problem.AddResidualBlock(root, {&x});
  EXPECT_EQ(problem.Solve(DenseOptions(50, 1e-10, 1e-12)).termination_type, ceres::FAILURE);
}

// Rows of all kinds, in full and with few numbers: the sums are those of the separate rows.
TEST(CompressedTerms, HasTheNormalEquationsOfItsTerms) {
  const Temporal temporal(Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitY())),
                          {1.0, 2.0, 3.0}, FingerPose::LinSpaced(-0.5, 0.5), 1.0);
  const ObjectData data({Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}}, 2.0);
  CompressedTerms all;
  const int fingers = all.AddBlock(kHandDofs, false), q = all.AddBlock(4, true),
            T = all.AddBlock(3, false);
  all.AddTerm(temporal, {q, T, fingers});
  all.AddTerm(data, {q, T});
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  const Eigen::Vector3d way(0.3, -0.2, 0.1);
  const FingerPose pose = FingerPose::LinSpaced(0.2, 0.1);
  const double* const parameters[] = {pose.data(), turn.coeffs().data(), way.data()};
  // J^T J, J^T r and r^T r by the tangents of fingers, rotation and translation.
  const auto normal = [&](const ceres::CostFunction& cost, std::vector<int> blocks) {
    constexpr int kColumn[] = {0, kHandDofs, kHandDofs + 3}, kSize[] = {kHandDofs, 3, 3};
    const RotationManifold manifold;
    std::vector<const double*> own;
    testing::Manifolds manifolds;
    for (const int b : blocks) {
      own.push_back(parameters[b]);
      manifolds.push_back(b == 1 ? &manifold : nullptr);
    }
    const auto [r, J] = testing::RowsAt(cost, own.data(), manifolds);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(r.size(), 6 + kHandDofs + 1);
    rows.rightCols<1>() = r;
    int column = 0;
    for (const int b : blocks) {
      rows.middleCols(kColumn[b], kSize[b]) = J.middleCols(column, kSize[b]);
      column += kSize[b];
    }
    const Eigen::MatrixXd system = rows.transpose() * rows;
    return system;
  };
  const Eigen::MatrixXd expected = normal(temporal, {1, 2, 0}) + normal(data, {1, 2});
  EXPECT_TRUE(normal(all, {0, 1, 2}).isApprox(expected, 1e-12));
  EXPECT_NEAR(testing::ResidualsAt(all, parameters).squaredNorm(),
              expected(expected.rows() - 1, expected.cols() - 1), 1e-12);
}

}  // namespace
}  // namespace holdfast
