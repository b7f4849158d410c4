// SPDX-License-Identifier: MIT
#include "solver/unknowns/dense_minimizer.h"

#include <limits>

#include <gtest/gtest.h>

#include "solver/terms/hand/object_data.h"
#include "solver/terms/hand/temporal.h"

namespace holdfast {
namespace {

struct Unknowns {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d T = Eigen::Vector3d::Zero();
  FingerPose fingers = FingerPose::Zero();
};

TEST(DenseMinimizer, RowsOfSeveralTermsMeetBetweenTheirGoals) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitY()));
  const FingerPose goal = FingerPose::LinSpaced(-0.5, 0.5);
  const Temporal temporal(turn, {1.0, 2.0, 3.0}, goal, 1.0);
  const FingerTemporal fingers(FingerPose::Zero(), 3.0);
  Unknowns x;
  DenseMinimizer minimizer;
  minimizer.AddBlock(x.fingers.data(), kHandDofs);
  minimizer.AddBlock(x.q.coeffs().data(), 4, true);
  minimizer.AddBlock(x.T.data(), 3);
  minimizer.AddTerm(temporal, {x.q.coeffs().data(), x.T.data(), x.fingers.data()});
  minimizer.AddTerm(fingers, {x.fingers.data()});
  const DenseMinimizer::Report report = minimizer.Minimize({.step_tolerance = 1e-12});
  EXPECT_EQ(report.stop, DenseMinimizer::Stop::kConverged);
  EXPECT_LT(x.q.angularDistance(turn), 1e-6);
  EXPECT_TRUE(x.T.isApprox(Eigen::Vector3d(1.0, 2.0, 3.0), 1e-6));
  EXPECT_TRUE(x.fingers.isApprox(0.25 * goal, 1e-6));
  EXPECT_NEAR(report.cost, 0.5 * 0.75 * goal.squaredNorm(), 1e-9);
}

TEST(DenseMinimizer, BlocksThatWereNotAddedStay) {
  const ObjectData data({Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}}, 1.0);
  Unknowns x;
  x.q = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX());
  DenseMinimizer minimizer;
  minimizer.AddBlock(x.T.data(), 3);
  minimizer.AddTerm(data, {x.q.coeffs().data(), x.T.data()});
  EXPECT_EQ(minimizer.Minimize({}).stop, DenseMinimizer::Stop::kConverged);
  EXPECT_NEAR(x.T.x(), 1.0, 1e-6);
  EXPECT_EQ(x.q.x(), std::sin(0.15));
}

// (x^2 - 2)^2 / 2 by its normal equations: 1.5 steps too far from 0.1, so that some are rejected.
class Root final : public NormalTerm {
 public:
  std::vector<int> TangentSizes() const override { return {1}; }
  double CostAt(double const* const* p) const override {
    const double r = p[0][0] * p[0][0] - 2.0;
    return 0.5 * r * r;
  }
  void NormalEquations(double const* const* p, Eigen::Ref<Eigen::MatrixXd> hessian,
                       Eigen::Ref<Eigen::VectorXd> gradient) const override {
    const double x = p[0][0];
    hessian(0, 0) = 4.0 * x * x;
    gradient(0) = 2.0 * x * (x * x - 2.0);
  }
};

TEST(DenseMinimizer, RejectsStepsThatGoTooFar) {
  const Root root;
  double x = 0.1;
  DenseMinimizer minimizer;
  minimizer.AddBlock(&x, 1);
  minimizer.AddTerm(root, {&x});
  const DenseMinimizer::Report report = minimizer.Minimize({});
  EXPECT_EQ(report.stop, DenseMinimizer::Stop::kConverged);
  EXPECT_NEAR(x, std::sqrt(2.0), 1e-4);
  EXPECT_GT(report.iterations, 3);
  x = 0.1;
  EXPECT_EQ(minimizer.Minimize({.max_iterations = 1}).stop, DenseMinimizer::Stop::kIterationLimit);
}

TEST(DenseMinimizer, FailsWhereTheCostIsNotFinite) {
  const Root root;
  double x = std::numeric_limits<double>::quiet_NaN();
  DenseMinimizer minimizer;
  minimizer.AddBlock(&x, 1);
  minimizer.AddTerm(root, {&x});
  EXPECT_EQ(minimizer.Minimize({}).stop, DenseMinimizer::Stop::kFailed);
}

}  // namespace
}  // namespace holdfast
