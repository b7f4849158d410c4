// SPDX-License-Identifier: MIT
#include "geometry/mesh/distance_grid.h"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using testing::Box;
using testing::Sphere;
using testing::Torus;

Eigen::Vector3d RandomIn(std::mt19937& random, double reach) {
  std::uniform_real_distribution<double> unit(-reach, reach);
  return {unit(random), unit(random), unit(random)};
}

class DistanceGridTest : public ::testing::Test {
 protected:
  const SignedDistance surface_{Sphere(0.04, 5)};
  const DistanceGrid grid_{surface_, {.cell_m = 0.004, .padding_m = 0.02}};
};

TEST_F(DistanceGridTest, IsCloseToTheSurfaceItSamples) {
  std::mt19937 random(1);
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d p = RandomIn(random, 0.06);
    const double exact = surface_.Distance(p);
    // Rounded near the center, where the distance has its crease; interpolated far off.
    const double tolerance = p.norm() < 0.012 ? 3e-3 : std::abs(exact) > 0.016 ? 2e-4 : 4e-5;
    EXPECT_NEAR(grid_.Distance(p), exact, tolerance);
  }
}

TEST_F(DistanceGridTest, IsExactAtItsNodesNearTheSurface) {
  int near = 0, far = 0;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d node =
        grid_.Min() + grid_.CellSize() * Eigen::Vector3d(i, 2 * i % 20, 19 - i);
    const double exact = surface_.Distance(node);
    const bool is_near = std::abs(exact) < 5.0 * grid_.CellSize();
    EXPECT_NEAR(grid_.Distance(node), exact, is_near ? 1e-14 : 1e-4);
    (is_near ? near : far) += 1;
  }
  EXPECT_GT(near, 5);
  EXPECT_GT(far, 2);
}

TEST_F(DistanceGridTest, LinearIsCloseAndHasItsOwnGradient) {
  std::mt19937 random(8);
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d p = RandomIn(random, 0.09);  // beyond the box too
    Eigen::Vector3d gradient;
    const double value = grid_.Linear(p, &gradient);
    EXPECT_EQ(value, grid_.Linear(p));
    // Cell^2 / 8R in each direction, and the rounded crease at the center.
    EXPECT_TRUE(p.norm() <= 0.02 || std::abs(value - grid_.Distance(p)) < 2e-4) << p.transpose();
    constexpr double kStep = 1e-8;
    const Eigen::Vector3d local = (p - grid_.Min()) / grid_.CellSize();
    if ((local.array() - local.array().round()).abs().minCoeff() < 1e-4) continue;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
      const double numeric = (grid_.Linear(p + step) - grid_.Linear(p - step)) / (2.0 * kStep);
      EXPECT_NEAR(gradient[k], numeric, 1e-6);
    }
  }
}

TEST_F(DistanceGridTest, GradientIsTheDerivativeOfTheValueEverywhere) {
  std::mt19937 random(2);
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d p = RandomIn(random, 0.09);  // beyond the box too
    Eigen::Vector3d gradient;
    EXPECT_EQ(grid_.Distance(p, &gradient), grid_.Distance(p));
    constexpr double kStep = 1e-7;
    const bool beside_the_box = (p - grid_.Min()).cwiseAbs().minCoeff() < 2 * kStep ||
                                (p - grid_.Max()).cwiseAbs().minCoeff() < 2 * kStep;
    if (beside_the_box) continue;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
      const double numeric = (grid_.Distance(p + step) - grid_.Distance(p - step)) / (2.0 * kStep);
      EXPECT_NEAR(gradient[k], numeric, 1e-5);
    }
  }
}

TEST_F(DistanceGridTest, ValueAndGradientAreContinuousAcrossCells) {
  std::mt19937 random(3);
  for (int i = 0; i < 500; ++i) {
    Eigen::Vector3d p = RandomIn(random, 0.05);
    const int axis = i % 3;
    const double cell = std::round((p[axis] - grid_.Min()[axis]) / grid_.CellSize());
    p[axis] = grid_.Min()[axis] + cell * grid_.CellSize();
    const Eigen::Vector3d step = 1e-12 * Eigen::Vector3d::Unit(axis);
    Eigen::Vector3d before;
    Eigen::Vector3d after;
    EXPECT_NEAR(grid_.Distance(p - step, &before), grid_.Distance(p + step, &after), 1e-11);
    EXPECT_LT((before - after).norm(), 1e-6);
  }
}

TEST_F(DistanceGridTest, OutsideOfTheBoxItIsAContinuousLowerBound) {
  std::mt19937 random(4);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d p = RandomIn(random, 0.3);
    const double exact = surface_.Distance(p);
    EXPECT_LT(grid_.Distance(p), exact + 4e-5);
    const Eigen::Vector3d on_box = p.cwiseMax(grid_.Min()).cwiseMin(grid_.Max());
    const Eigen::Vector3d beside = on_box + 1e-9 * (p - on_box);
    EXPECT_NEAR(grid_.Distance(on_box), grid_.Distance(beside), 1e-8);
  }
  EXPECT_GT(grid_.Distance({10.0, 0.0, 0.0}), 9.9);
}

TEST(DistanceGrid, KeepsTheSignOfThinPartsAtItsCellSize) {
  const SignedDistance surface(Torus(0.04, 0.01, 60, 30));
  const DistanceGrid grid(surface, {.cell_m = 0.002});
  std::mt19937 random(5);
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d p = RandomIn(random, 0.055);
    const double exact = surface.Distance(p);
    if (std::abs(exact) < 2e-4) continue;
    EXPECT_EQ(grid.Distance(p) < 0.0, exact < 0.0);
  }
}

TEST(DistanceGrid, IsTheSameForAnyInstructionSetAndNumberOfThreads) {
  const SignedDistance surface(Torus(0.04, 0.015, 30, 20));
  const DistanceGrid plain(surface, {.cell_m = 0.005, .threads = 1, .isa = Isa::kScalar});
  const DistanceGrid best(surface, {.cell_m = 0.005, .threads = 2});
  std::mt19937 random(7);
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d p = RandomIn(random, 0.1);
    Eigen::Vector3d plain_gradient, best_gradient;
    EXPECT_EQ(plain.Distance(p), best.Distance(p));
    EXPECT_EQ(plain.Distance(p, &plain_gradient), best.Distance(p, &best_gradient));
    EXPECT_EQ(plain_gradient, best_gradient);
  }
}

TEST(DistanceGrid, GrowsItsCellsRatherThanItsMemory) {
  const SignedDistance surface(Box({-1, -1, -1}, {1, 1, 1}));
  const DistanceGrid grid(surface, {.cell_m = 1e-6, .max_nodes = 20'000});
  EXPECT_LE(grid.NumNodes(), 20'000u);
  EXPECT_GT(grid.NumNodes(), 12'000u);
  EXPECT_NEAR(grid.Distance({0.5, 0.1, 0.2}), -0.5, 0.05);
}

TEST(DistanceGrid, RefusesAbsurdOptions) {
  const SignedDistance surface(Box({-1, -1, -1}, {1, 1, 1}));
  EXPECT_THROW(DistanceGrid(surface, {.cell_m = 0.0}), Error);
  EXPECT_THROW(DistanceGrid(surface, {.cell_m = std::nan("")}), Error);
  EXPECT_THROW(DistanceGrid(surface, {.padding_m = -1.0}), Error);
}

}  // namespace
}  // namespace holdfast
