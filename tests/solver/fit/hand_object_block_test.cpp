// SPDX-License-Identifier: MIT
#include "solver/fit/hand_object_block.h"

#include <cmath>

#include <ceres/problem.h>
#include <ceres/solver.h>

#include <gtest/gtest.h>

#include "solver/terms/hand/paper_terms.h"
#include "solver/terms/motion/goal_terms.h"
#include "solver/unknowns/ceres_solve.h"
#include "solver/unknowns/dense_problem.h"
#include "solver/unknowns/rotation_manifold.h"
#include "tests/support/hand_scene.h"
#include "tests/support/numeric_jacobian.h"
#include "tests/support/plain_terms.h"

namespace holdfast {
namespace {

using testing::HandScene;
using testing::PlainPairs;

// D of the scene, and a point some way off it, as after a frame's motion.
struct Setting {
  explicit Setting(Side side = Side::kRight) : scene(side), state(scene.hand) {
    state.SetBody(scene.pose, scene.trans);
    state.Evaluate(FingersOf(scene.pose, side), false);
    reference =
        HandObjectDistance::Distances(InObjectFrame(state.Vertices(), scene.object_pose.orientation,
                                                    scene.object_pose.translation),
                                      scene.object);
    orientation = scene.object_pose.orientation *
                  Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()));
    translation = scene.object_pose.translation + Eigen::Vector3d(0.01, -0.004, 0.007);
    std::srand(3);
    fingers = FingersOf(scene.pose, side) + 0.1 * FingerPose::Random();
  }
  std::vector<double*> Parameters() {
    return {orientation.coeffs().data(), translation.data(), fingers.data()};
  }

  HandScene scene;
  HandState state;
  Eigen::MatrixXd reference;
  Eigen::Quaterniond orientation;
  Eigen::Vector3d translation;
  FingerPose fingers;
};

// Cost, gradient and Gauss-Newton matrix of a cost function in the tangent of its parameters.
HandObjectBlock::System Assemble(const ceres::CostFunction& cost, Setting& setting) {
  const RotationManifold manifold;
  const auto [r, J] = testing::RowsAt(cost, setting.Parameters().data(), {&manifold});
  return {J.transpose() * J, J.transpose() * r, 0.5 * r.squaredNorm()};
}

void ExpectEqual(const HandObjectBlock::System& a, const HandObjectBlock::System& b,
                 double relative) {
  EXPECT_NEAR(a.cost, b.cost, relative * b.cost);
  EXPECT_LT((a.gradient - b.gradient).norm(), relative * b.gradient.norm());
  EXPECT_LT((a.hessian - b.hessian).norm(), relative * b.hessian.norm());
}

TEST(HandObjectBlock, DistanceTermEqualsAllPairResiduals) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    Setting s(side);
    const HandObjectDistance term(s.scene.object, s.reference, 1.7, PairPrecision::kDouble);
    HandObjectBlock block(&s.state);
    block.AddTerm(EnergyTerm::kDistance, &term);
    HandState plain_state(s.scene.hand);
    plain_state.SetBody(s.scene.pose, s.scene.trans);
    const PlainPairs plain(PlainPairs::Kind::kDistance, &plain_state, s.scene.object, s.reference,
                           0.0, 1.7);
    ASSERT_EQ(plain.num_residuals(), 300 * s.scene.hand.NumVertices());
    const HandObjectBlock::System expected = Assemble(plain, s);
    HandObjectBlock::System system;
    block.Linearize(s.Parameters().data(), system);
    ExpectEqual(system, expected, 1e-10);              // the normal equations
    ExpectEqual(Assemble(block, s), expected, 1e-10);  // the 51 + 1 rows that Ceres gets
    EXPECT_NEAR(1.7 * 0.5 * block.EnergiesAt(s.Parameters().data())[EnergyTerm::kDistance],
                expected.cost, 1e-10 * expected.cost);
  }
}

TEST(HandObjectBlock, SinglePrecisionStaysClose) {
  Setting s;
  const HandObjectDistance exact(s.scene.object, s.reference, 1.0, PairPrecision::kDouble);
  const HandObjectDistance fast(s.scene.object, s.reference, 1.0, PairPrecision::kSingle);
  HandObjectBlock::System systems[2];
  for (int k = 0; k < 2; ++k) {
    HandObjectBlock block(&s.state);
    block.AddTerm(EnergyTerm::kDistance, k == 0 ? &exact : &fast);
    block.Linearize(s.Parameters().data(), systems[k]);
  }
  ExpectEqual(systems[1], systems[0], 2e-6);
}

TEST(HandObjectBlock, ContactClosedFormEqualsAllContactPairs) {
  Setting s;
  const double tau = 0.02;
  const Contact term(s.scene.object, s.reference, tau, 0.3);
  ASSERT_GT(term.NumPairs(), 20);
  EXPECT_EQ(term.NumPairs(), (s.reference.array() < tau).count());
  HandObjectBlock block(&s.state);
  block.AddTerm(EnergyTerm::kDistance, &term);
  HandState plain_state(s.scene.hand);
  plain_state.SetBody(s.scene.pose, s.scene.trans);
  const PlainPairs plain(PlainPairs::Kind::kContact, &plain_state, s.scene.object, s.reference, tau,
                         0.3);
  const HandObjectBlock::System expected = Assemble(plain, s);
  HandObjectBlock::System system;
  block.Linearize(s.Parameters().data(), system);
  ExpectEqual(system, expected, 1e-10);
  ExpectEqual(Assemble(block, s), expected, 1e-8);  // rank-deficient: the factor drops null rows
}

TEST(HandObjectBlock, TermsAddUp) {
  Setting s;
  const HandObjectDistance distance(s.scene.object, s.reference, 1.0, PairPrecision::kDouble);
  const Contact contact(s.scene.object, s.reference, 0.02, 50.0);
  HandObjectBlock::System a, b, both;
  HandObjectBlock block_a(&s.state), block_b(&s.state), block_both(&s.state);
  block_a.AddTerm(EnergyTerm::kDistance, &distance);
  block_b.AddTerm(EnergyTerm::kContact, &contact);
  block_both.AddTerm(EnergyTerm::kDistance, &distance);
  block_both.AddTerm(EnergyTerm::kContact, &contact);
  block_a.Linearize(s.Parameters().data(), a);
  block_b.Linearize(s.Parameters().data(), b);
  block_both.Linearize(s.Parameters().data(), both);
  ExpectEqual(both, {a.hessian + b.hessian, a.gradient + b.gradient, a.cost + b.cost}, 1e-12);
}

TEST(HandObjectBlock, GradientMatchesCentralDifferences) {
  Setting s;
  const HandObjectDistance distance(s.scene.object, s.reference, 1.0, PairPrecision::kDouble);
  const Contact contact(s.scene.object, s.reference, 0.02, 5.0);
  HandObjectBlock block(&s.state);
  block.AddTerm(EnergyTerm::kDistance, &distance);
  block.AddTerm(EnergyTerm::kContact, &contact);
  HandObjectBlock::System system;
  block.Linearize(s.Parameters().data(), system);
  const RotationManifold manifold;
  const Eigen::VectorXd numeric = testing::CostGradientAt(block, s.Parameters(), {&manifold}, 1e-5);
  for (int k = 0; k < HandObjectBlock::kTangent; ++k) {
    EXPECT_NEAR(system.gradient(k), numeric(k), 1e-6 * system.gradient.norm()) << k;
  }
}

// Compressed to one residual block, terms have the minimum that they have as separate ones.
TEST(HandObjectBlock, CompressedTermsEndWhereSeparateOnesDo) {
  Setting s;
  const HandObjectDistance distance(s.scene.object, s.reference, 1.0, PairPrecision::kDouble);
  const Contact contact(s.scene.object, s.reference, 0.02, 5.0);
  HandObjectBlock block(&s.state);
  block.AddTerm(EnergyTerm::kDistance, &distance);
  block.AddTerm(EnergyTerm::kContact, &contact);
  const NearPoint near(s.fingers, 1e-3);
  Setting a = s, b = s;
  DenseProblem compressed;
  compressed.AddParameterBlock(a.fingers.data(), kHandDofs);
  compressed.AddParameterBlock(a.orientation.coeffs().data(), 4, true);
  compressed.AddParameterBlock(a.translation.data(), 3);
  compressed.AddResidualBlock(block, a.Parameters());
  compressed.AddResidualBlock(near, {a.fingers.data()});
  const ceres::Solver::Summary report = compressed.Solve(DenseOptions(100, 1e-10, 1e-14));
  EXPECT_TRUE(report.IsSolutionUsable()) << report.BriefReport();

  ceres::Problem problem(BorrowingProblem());
  RotationManifold manifold;
  NearPoint near_for_ceres(s.fingers, 1e-3);
  problem.AddParameterBlock(b.orientation.coeffs().data(), 4, &manifold);
  problem.AddResidualBlock(&block, nullptr, b.Parameters());
  problem.AddResidualBlock(&near_for_ceres, nullptr, b.fingers.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-14;
  options.parameter_tolerance = 1e-10;
  options.gradient_tolerance = 0.0;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  EXPECT_NEAR(report.final_cost, summary.final_cost, 1e-7 * summary.final_cost);
  EXPECT_LT(report.final_cost, 0.5 * summary.initial_cost);
  EXPECT_LT(a.orientation.angularDistance(b.orientation), 1e-4);
  EXPECT_LT((a.translation - b.translation).norm(), 1e-5);
}

TEST(HandObjectBlock, CostWithoutJacobianIsTheSameCost) {
  Setting s;
  const HandObjectDistance distance(s.scene.object, s.reference, 1.0);
  HandObjectBlock block(&s.state);
  block.AddTerm(EnergyTerm::kDistance, &distance);
  const Eigen::VectorXd r = testing::ResidualsAt(block, s.Parameters().data());
  EXPECT_NEAR(0.5 * r.squaredNorm(), Assemble(block, s).cost, 1e-12);
}

TEST(HandObjectBlock, RefusesAPointThatIsNotFinite) {
  Setting s;
  const HandObjectDistance distance(s.scene.object, s.reference, 1.0, PairPrecision::kDouble);
  HandObjectBlock block(&s.state);
  block.AddTerm(EnergyTerm::kDistance, &distance);
  s.translation.x() = NAN;
  Eigen::Matrix<double, HandObjectBlock::kRows, 1> r;
  EXPECT_FALSE(block.Evaluate(s.Parameters().data(), r.data(), nullptr));
}

TEST(HandObjectBlock, EnergyIgnoresWhereTheSceneStands) {
  // Moving hand and object rigidly together changes neither term.
  Setting s;
  const HandObjectDistance distance(s.scene.object, s.reference, 1.0, PairPrecision::kDouble);
  const auto energy = [&](const Eigen::Matrix3Xd& at) {
    std::vector<VertexQuadratic> ignored(static_cast<std::size_t>(at.cols()));
    return distance.Add(at, ignored);
  };
  const Eigen::Matrix3Xd z = InObjectFrame(s.state.Vertices(), s.orientation, s.translation);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, -1, 2).normalized()));
  const Eigen::Vector3d shift(3, -1, 2);
  const Eigen::Matrix3Xd moved = (turn.toRotationMatrix() * s.state.Vertices()).colwise() + shift;
  const Eigen::Matrix3Xd z_moved =
      InObjectFrame(moved, turn * s.orientation, turn * s.translation + shift);
  EXPECT_NEAR(energy(z), energy(z_moved), 1e-10 * energy(z));
}

}  // namespace
}  // namespace holdfast
