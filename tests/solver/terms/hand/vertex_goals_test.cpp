// SPDX-License-Identifier: MIT
#include "solver/terms/hand/vertex_goals.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace holdfast {
namespace {

constexpr int kVertices = 4;
const VertexQuadratic kNothing{Eigen::Matrix3d::Zero(), Eigen::Vector3d::Zero(), 0.0};

struct GoalScene {
  Eigen::Matrix3Xd goals = Eigen::Matrix3Xd::Random(3, kVertices);
  Eigen::VectorXd weights = Eigen::Vector4d(1.0, 0.5, 0.0, 2.0);
  VertexGoals term{goals, weights, 30.0};

  double CostAt(const Eigen::Matrix3Xd& z) const {
    std::vector<VertexQuadratic> quadratics(kVertices, kNothing);
    term.Add(z, quadratics);
    double cost = 0.0;
    for (const VertexQuadratic& quadratic : quadratics) cost += quadratic.cost;
    return cost;
  }
};

TEST(VertexGoals, VanishWhereTheHandIsWhereItWasWanted) {
  const GoalScene scene;
  EXPECT_EQ(scene.CostAt(scene.goals), 0.0);
}

TEST(VertexGoals, HaveTheGradientAndHessianOfTheirCost) {
  const GoalScene scene;
  const Eigen::Matrix3Xd z = Eigen::Matrix3Xd::Random(3, kVertices);
  std::vector<VertexQuadratic> quadratics(kVertices, kNothing);
  const double energy = scene.term.Add(z, quadratics);
  EXPECT_NEAR(scene.CostAt(z), 0.5 * 30.0 * energy, 1e-12);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < kVertices; ++i) {
    for (int k = 0; k < 3; ++k) {
      Eigen::Matrix3Xd more = z, less = z;
      more(k, i) += kStep;
      less(k, i) -= kStep;
      const double a = scene.CostAt(more), b = scene.CostAt(less), c = scene.CostAt(z);
      EXPECT_NEAR(quadratics[i].gradient(k), (a - b) / (2.0 * kStep), 1e-6);
      EXPECT_NEAR(quadratics[i].hessian(k, k), (a - 2.0 * c + b) / (kStep * kStep), 1e-3);
    }
  }
}

TEST(VertexGoals, LeaveVerticesWithoutWeightAlone) {
  const GoalScene scene;
  std::vector<VertexQuadratic> quadratics(kVertices, kNothing);
  scene.term.Add(Eigen::Matrix3Xd::Constant(3, kVertices, NAN).eval(), quadratics);
  EXPECT_EQ(quadratics[2].cost, 0.0);
  EXPECT_EQ(quadratics[2].gradient, Eigen::Vector3d::Zero());
}

}  // namespace
}  // namespace holdfast
