// SPDX-License-Identifier: MIT
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "generator/nn/random_stream.h"
#include "geometry/rotation.h"
#include "solver/terms/motion/feet_terms.h"
#include "solver/terms/motion/goal_terms.h"
#include "solver/terms/motion/posture_terms.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::JacobianError;

using Blocks = std::vector<VectorXd>;

std::vector<double*> Pointers(Blocks& blocks) {
  std::vector<double*> pointers;
  for (VectorXd& block : blocks) pointers.push_back(block.data());
  return pointers;
}

VectorXd Residuals(const ceres::CostFunction& cost, Blocks blocks) {
  VectorXd residuals = VectorXd::Constant(cost.num_residuals(), NAN);
  EXPECT_TRUE(cost.Evaluate(Pointers(blocks).data(), residuals.data(), nullptr));
  return residuals;
}

VectorXd RowByRow(const Matrix3d& R) {
  VectorXd numbers(9);
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{numbers.data()} = R;
  return numbers;
}

struct Draw {
  explicit Draw(std::uint64_t seed) : random(seed) {}
  double Number(double low, double high) { return low + (high - low) * random.Uniform(); }
  Vector3d Point(double half = 1.0) {
    return Vector3d::NullaryExpr([&] { return Number(-half, half); });
  }
  Matrix3d Rotation() { return ExpSO3(Point(1.2)); }
  nn::RandomStream random;
};

// Compares Jacobians at random places of which at least three are where the term acts and, for one
// that does not act everywhere, three where it does not.
void CheckJacobian(const ceres::CostFunction& cost, bool acts_everywhere,
                   const std::function<Blocks(Draw&)>& any) {
  Draw draw(17);
  int acting = 0, idle = 0;
  for (int i = 0; i < 40; ++i) {
    Blocks at = any(draw);
    ASSERT_EQ(at.size(), cost.parameter_block_sizes().size());
    (Residuals(cost, at).isZero(0.0) ? idle : acting) += 1;
    EXPECT_LT(JacobianError(cost, Pointers(at)), 2e-6) << "place " << i;
    // One block's Jacobian alone is what it is among the others.
    std::vector<testing::RowMatrix> all, one;
    std::vector<double*> all_data;
    for (const int size : cost.parameter_block_sizes()) {
      all.emplace_back(testing::RowMatrix::Constant(cost.num_residuals(), size, NAN));
      one.push_back(all.back());
    }
    for (testing::RowMatrix& J : all) all_data.push_back(J.data());
    VectorXd residuals(cost.num_residuals());
    cost.Evaluate(Pointers(at).data(), residuals.data(), all_data.data());
    for (std::size_t b = 0; b < at.size(); ++b) {
      std::vector<double*> only(at.size(), nullptr);
      only[b] = one[b].data();
      cost.Evaluate(Pointers(at).data(), residuals.data(), only.data());
      EXPECT_EQ(one[b], all[b]) << "block " << b;
    }
  }
  EXPECT_GE(acting, 3);
  if (acts_everywhere) {
    EXPECT_EQ(idle, 0);
  } else {
    EXPECT_GE(idle, 3);
  }
}

Blocks Points(Draw& draw, int count, double half = 1.0) {
  Blocks blocks;
  for (int k = 0; k < count; ++k) blocks.emplace_back(draw.Point(half));
  return blocks;
}

TEST(Airborne, LooksAtTheLowestFootJointAlone) {
  const MotionTerm term = Airborne({0.08, 0.02, 0.08}, 0.05, 4.0);
  CheckJacobian(*term, false, [](Draw& draw) {
    Blocks feet = Points(draw, 3, 0.2);
    for (VectorXd& foot : feet) foot[2] += 0.2;
    return feet;
  });
  // Heights above rest 0.22, 0.28 and 0.12: the last is 7 cm higher than is allowed.
  const Blocks high = {Vector3d(1, 2, 0.30), Vector3d(3, 4, 0.30), Vector3d(5, 6, 0.20)};
  EXPECT_NEAR(Residuals(*term, high)[0], 2.0 * 0.07, 1e-12);
  const Blocks one_stands = {Vector3d(1, 2, 0.08), Vector3d(3, 4, 1.30), Vector3d(5, 6, 1.20)};
  EXPECT_EQ(Residuals(*term, one_stands)[0], 0.0);
}

TEST(ApproachDirection, IsZeroAlongTheDirectionHoweverLongTheForearm) {
  const Vector3d direction = Vector3d(1, -2, 0.5).normalized();
  const MotionTerm term = ApproachDirection(direction, 9.0);
  CheckJacobian(*term, true, [](Draw& draw) { return Points(draw, 2); });
  const Vector3d elbow(0.3, 0.1, 1.2);
  for (const double length : {0.1, 0.25, 2.0}) {
    EXPECT_LT(Residuals(*term, {elbow, elbow + length * direction}).norm(), 1e-12);
    EXPECT_NEAR(Residuals(*term, {elbow, elbow - length * direction}).norm(), 3.0 * 2.0, 1e-12);
  }
  const Vector3d across = direction.unitOrthogonal();
  EXPECT_NEAR(Residuals(*term, {elbow, elbow + across}).norm(), 3.0 * std::numbers::sqrt2, 1e-12);
}

TEST(Cadence, IsZeroForFeetThatHaveChangedPlaces) {
  const Eigen::Vector2d along = Eigen::Vector2d(3.0, -4.0) / 5.0;
  const MotionTerm term = Cadence(along, 9.0);
  CheckJacobian(*term, true, [](Draw& draw) { return Points(draw, 4); });
  const Vector3d way(along.x(), along.y(), 0.0), across(-along.y(), along.x(), 0.0);
  const Vector3d left(1, 2, 0.1), right = left - 0.6 * way + 0.2 * across;
  // A step of 60 cm: who was behind is in front by as much, whatever the feet do to the sides and
  // up, and however far the body came.
  const Vector3d later = 5.0 * way + Vector3d(0, 0, 0.2);
  const Vector3d swung = left + later + 0.6 * way + 0.1 * across;
  EXPECT_NEAR(Residuals(*term, {left, right, left + later, swung})[0], 0.0, 1e-12);
  // Twice as quick: both steps are done, and the feet are as they were.
  EXPECT_NEAR(Residuals(*term, {left, right, left + later, right + later})[0], 3.0 * 2.0 * 0.6,
              1e-12);
  EXPECT_NEAR(Residuals(*term, {right, left, right + later, left + later})[0], -3.0 * 2.0 * 0.6,
              1e-12);
}

TEST(FirstArrival, IsASoftMinimumOfTheDistance) {
  constexpr int kFrames = 6;
  const Vector3d goal(0.2, -0.4, 1.1);
  for (const double tau : {0.5, 0.1}) {
    // Near enough to one another that all of them have a share.
    CheckJacobian(*FirstArrival(goal, kFrames, tau, 2.0), true, [&](Draw& draw) {
      Blocks frames = Points(draw, kFrames, 0.8 * tau);
      for (VectorXd& frame : frames) frame += goal;
      return frames;
    });
  }
  Draw draw(3);
  for (int i = 0; i < 20; ++i) {
    const Blocks frames = Points(draw, kFrames, 1.5);
    double least = INFINITY;
    for (const VectorXd& frame : frames) least = std::min(least, (frame - goal).norm());
    double before = INFINITY;
    for (const double tau : {1.0, 0.3, 0.1, 0.01}) {
      const double value = Residuals(*FirstArrival(goal, kFrames, tau, 1.0), frames)[0];
      EXPECT_GE(value, least - 1e-12);
      EXPECT_LE(value * value, least * least + tau * tau * std::log(kFrames) + 1e-12);
      EXPECT_LE(value, before + 1e-12) << "falls with tau";
      before = value;
    }
    EXPECT_NEAR(before, least, 1e-3);
  }
  // All frames equally far: exactly that far, for any tau.
  const Blocks same(kFrames, VectorXd(goal + Vector3d(0.3, 0.0, 0.0)));
  EXPECT_NEAR(Residuals(*FirstArrival(goal, kFrames, 0.5, 4.0), same)[0], 2.0 * 0.3, 1e-12);
  // There is no distance whose square root would not be a number.
  const Blocks there(kFrames, VectorXd(goal));
  EXPECT_LT(Residuals(*FirstArrival(goal, kFrames, 0.5, 1.0), there)[0], 1e-8);
}

TEST(FirstArrival, PullsTheNearestFrameMost) {
  const Vector3d goal = Vector3d::Zero();
  const MotionTerm term = FirstArrival(goal, 3, 0.2, 1.0);
  Blocks at = {Vector3d(0.5, 0, 0), Vector3d(0.3, 0, 0), Vector3d(0.6, 0, 0)};
  double slope[3][3], residual = 0.0;
  double* jacobians[3] = {slope[0], slope[1], slope[2]};
  ASSERT_TRUE(term->Evaluate(Pointers(at).data(), &residual, jacobians));
  EXPECT_GT(slope[1][0], 10.0 * slope[0][0]);
  EXPECT_GT(slope[0][0], slope[2][0]);
  EXPECT_GT(slope[2][0], 0.0) << "the farthest is pulled too";
}

TEST(FloorContact, PushesUpWhatIsTooLow) {
  const MotionTerm term = FloorContact(0.05, 4.0);
  CheckJacobian(*term, false, [](Draw& draw) { return Points(draw, 1); });
  EXPECT_NEAR(Residuals(*term, {Vector3d(3, 4, -0.02)})[0], 2.0 * 0.07, 1e-12);
  EXPECT_EQ(Residuals(*term, {Vector3d(3, 4, 0.06)})[0], 0.0);
}

TEST(FootSkate, IsTheHorizontalStep) {
  const MotionTerm term = FootSkate(9.0);
  CheckJacobian(*term, true, [](Draw& draw) { return Points(draw, 2); });
  const VectorXd r = Residuals(*term, {Vector3d(1, 1, 0), Vector3d(1.02, 0.97, 0.4)});
  EXPECT_NEAR(r[0], 0.06, 1e-12);
  EXPECT_NEAR(r[1], -0.09, 1e-12);
}

TEST(FootSkate, AFootIsPlantedLowAndNotHigh) {
  EXPECT_EQ(PlantedShare(-0.1), 1.0);
  EXPECT_EQ(PlantedShare(0.0), 1.0);
  EXPECT_EQ(PlantedShare(0.02), 1.0);
  EXPECT_NEAR(PlantedShare(0.04), 0.5, 1e-12);
  EXPECT_EQ(PlantedShare(0.06), 0.0);
  EXPECT_EQ(PlantedShare(1.0), 0.0);
  double before = 1.0;
  for (double height = 0.02; height < 0.0605; height += 1e-4) {
    const double share = PlantedShare(height);
    EXPECT_LE(share, before);
    EXPECT_LT(before - share, 0.005) << "no step at " << height;
    before = share;
  }
}

TEST(JointAcceleration, IsTheSecondDifference) {
  const double dt = 1.0 / 30.0;
  const JointAcceleration term(dt, 4.0);
  CheckJacobian(term, true, [](Draw& draw) { return Points(draw, 3); });
  const Vector3d start(1, 2, 3), velocity(0.5, -1, 2), acceleration(0.3, 9.81, -4);
  const auto at = [&](double t) -> VectorXd {
    return start + t * velocity + 0.5 * t * t * acceleration;
  };
  EXPECT_LT(
      (Residuals(term, {at(0.2), at(0.2 + dt), at(0.2 + 2 * dt)}) - 2.0 * acceleration).norm(),
      1e-9);
}

TEST(LookAt, IsZeroForAFaceThatLooksThere) {
  const Vector3d goal(0.5, -1.5, 1.2);
  const MotionTerm term = LookAt(goal, 4.0);
  CheckJacobian(*term, true, [](Draw& draw) {
    return Blocks{RowByRow(draw.Rotation()), draw.Point(0.6)};
  });
  const Vector3d head(0.1, 0.2, 1.6);
  // Faces look along z; whichever way the head is rolled about it.
  for (const double roll : {0.0, 1.0}) {
    Matrix3d A;
    A.col(2) = (goal - head).normalized();
    A.col(0) = A.col(2).unitOrthogonal();
    A.col(1) = A.col(2).cross(A.col(0));
    A = A * ExpSO3(Vector3d(0, 0, roll));
    EXPECT_LT(Residuals(*term, {RowByRow(A), head}).norm(), 1e-12);
    const Matrix3d away = A * ExpSO3(Vector3d(0, std::numbers::pi, 0));
    EXPECT_NEAR(Residuals(*term, {RowByRow(away), head}).norm(), 2.0 * 2.0, 1e-12);
  }
}

TEST(NearPoint, IsTheWayFromThePoint) {
  Draw draw(5);
  const VectorXd point = VectorXd::NullaryExpr(7, [&] { return draw.Number(-2, 2); });
  const NearPoint term(point, 0.25);
  CheckJacobian(term, true, [](Draw& any) {
    return Blocks{VectorXd::NullaryExpr(7, [&] { return any.Number(-2, 2); })};
  });
  EXPECT_TRUE(Residuals(term, {point}).isZero(0.0));
  const NearPoint length(point, 0.25, NearPoint::Residuals::kLength);
  CheckJacobian(length, true, [](Draw& any) {
    return Blocks{VectorXd::NullaryExpr(7, [&] { return any.Number(-2, 2); })};
  });
  const VectorXd other = VectorXd::NullaryExpr(7, [&] { return draw.Number(-2, 2); });
  EXPECT_NEAR(Residuals(length, {other})[0], Residuals(term, {other}).norm(), 1e-12);
  const Vector3d goal(1, -2, 0.7);
  EXPECT_LT(
      (Residuals(NearPoint(goal, 4.0), {goal + Vector3d(0.1, 0, -0.2)}) - Vector3d(0.2, 0, -0.4))
          .norm(),
      1e-12);
}

TEST(Obstacle, KeepsAJointAsFarOutAsItIsThick) {
  DistanceGridOptions options;
  options.cell_m = 0.02;
  options.padding_m = 0.3;
  const DistanceGrid grid(SignedDistance(testing::Box({-0.2, -0.15, 0.0}, {0.2, 0.15, 1.0})),
                          options);
  const MotionTerm term = Obstacle(grid, 0.13, 4.0);
  CheckJacobian(*term, false,
                [](Draw& draw) -> Blocks { return {draw.Point(0.4) + Vector3d(0, 0, 0.5)}; });
  EXPECT_NEAR(Residuals(*term, {Vector3d(0.25, 0, 0.5)})[0], 2.0 * 0.08, 1e-3);
  EXPECT_NEAR(Residuals(*term, {Vector3d(0, 0.08, 0.5)})[0], 2.0 * (0.13 + 0.07), 1e-3);
  EXPECT_EQ(Residuals(*term, {Vector3d(0.35, 0, 0.5)})[0], 0.0);
  EXPECT_EQ(Residuals(*term, {Vector3d(5, 5, 5)})[0], 0.0);
}

TEST(PelvisPath, IsTheHorizontalWayFromThePath) {
  const MotionTerm term = PelvisPath({0.5, -1.0}, 4.0);
  CheckJacobian(*term, true, [](Draw& draw) { return Points(draw, 1); });
  EXPECT_LT((Residuals(*term, {Vector3d(0.6, -1.2, 7)}) - Eigen::Vector2d(0.2, -0.4)).norm(),
            1e-12);
}

TEST(HorizontalLimit, CountsWhatIsFasterThanAWalk) {
  const double dt = 1.0 / 3.0;
  const MotionTerm term = HorizontalLimit(1.5, dt, 4.0);
  CheckJacobian(*term, false, [](Draw& draw) { return Points(draw, 2, 0.4); });
  const auto at = [&](double speed) {
    return Residuals(
        *term, {Vector3d(1, 1, 0.9), Vector3d(1, 1, 0.2) + speed * dt * Vector3d(0.6, -0.8, 0)})[0];
  };
  EXPECT_EQ(at(0.0), 0.0);
  EXPECT_EQ(at(1.49), 0.0) << "rising and sinking is no walking";
  EXPECT_NEAR(at(2.0), 2.0 * 0.5, 1e-9);
}

TEST(HeadingAlong, IsTheAngleFromTheFacingToTheWay) {
  const Eigen::Vector2d along = Eigen::Vector2d(3.0, -4.0) / 5.0;
  const MotionTerm term = HeadingAlong(along, 4.0);
  CheckJacobian(*term, true, [](Draw& draw) { return Blocks{RowByRow(draw.Rotation())}; });
  // Upright, the face along the ground: x to the left of it, y up.
  const auto facing = [&](double angle, double bow) {
    const Eigen::Vector2d z = Eigen::Rotation2Dd(angle) * along;
    Matrix3d A;
    A.col(1) = Vector3d::UnitZ();
    A.col(2) = Vector3d(z.x(), z.y(), 0.0);
    A.col(0) = A.col(1).cross(A.col(2));
    return RowByRow(A * ExpSO3(Vector3d(bow, 0, 0)));
  };
  EXPECT_NEAR(Residuals(*term, {facing(0.0, 0.0)})[0], 0.0, 1e-12);
  for (const double angle : {0.4, -0.4, 2.0, -3.0}) {
    EXPECT_NEAR(Residuals(*term, {facing(angle, 0.0)})[0], -2.0 * angle, 1e-12);
    EXPECT_NEAR(Residuals(*term, {facing(angle, 0.3)})[0], -2.0 * angle, 1e-12)
        << "a bow is no turn";
  }
  Blocks up = {RowByRow(Matrix3d::Identity())};  // faces straight up: no heading
  double residual = 0.0;
  EXPECT_FALSE(term->Evaluate(Pointers(up).data(), &residual, nullptr));
}

TEST(HeadingTurn, CountsWhatIsFasterThanAWalkedTurn) {
  const double dt = 0.25;
  const MotionTerm term = HeadingTurn(1.0, dt, 4.0);
  CheckJacobian(*HeadingTurn(4.0, dt, 4.0), false, [](Draw& draw) {
    return Blocks{RowByRow(draw.Rotation()), RowByRow(draw.Rotation())};
  });
  const Matrix3d facing = ExpSO3(Vector3d(0.5 * std::numbers::pi, 0.0, 0.0));  // along the ground
  const auto at = [&](double rate, double lean) {
    const Matrix3d turned = ExpSO3(Vector3d(0.0, 0.0, rate * dt)) * facing;
    return Residuals(*term, {RowByRow(facing), RowByRow(turned * ExpSO3(Vector3d(lean, 0, 0)))})[0];
  };
  EXPECT_EQ(at(0.0, 0.0), 0.0);
  EXPECT_EQ(at(0.99, 0.0), 0.0);
  for (const double rate : {1.5, -1.5, 3.0}) {
    EXPECT_NEAR(at(rate, 0.0), 2.0 * (std::abs(rate) - 1.0), 1e-9);
    EXPECT_NEAR(at(rate, 0.3), 2.0 * (std::abs(rate) - 1.0), 1e-9) << "a bow is no turn";
  }
  const Matrix3d up = Matrix3d::Identity();  // faces straight up: no heading
  Blocks none = {RowByRow(up), RowByRow(facing)};
  double residual = 0.0;
  EXPECT_FALSE(term->Evaluate(Pointers(none).data(), &residual, nullptr));
}

TEST(RotationRange, IsTheAngleBeyondTheLimit) {
  const MotionTerm term = RotationRange(0.9, 4.0);
  CheckJacobian(*term, false, [](Draw& draw) { return Blocks{RowByRow(draw.Rotation())}; });
  Draw draw(8);
  for (const double angle : {0.0, 0.5, 0.89, 1.2, 2.5}) {
    const Matrix3d R = ExpSO3(angle * draw.Point().normalized());
    EXPECT_NEAR(Residuals(*term, {RowByRow(R)})[0], 2.0 * std::max(0.0, angle - 0.9), 1e-7);
  }
  // Half a turn, where the arc cosine has no slope: still numbers.
  Blocks half_turn = {RowByRow(Vector3d(-1, -1, 1).asDiagonal())};
  double residual = 0.0, slope[9];
  double* jacobians[1] = {slope};
  ASSERT_TRUE(term->Evaluate(Pointers(half_turn).data(), &residual, jacobians));
  EXPECT_NEAR(residual, 2.0 * (std::numbers::pi - 0.9), 1e-6);
  for (const double value : slope) EXPECT_TRUE(std::isfinite(value));
}

TEST(StandNear, CountsWhatIsBeyondAnArmsReach) {
  const MotionTerm term = StandNear({1.0, 2.0, 0.3}, 0.5, 4.0);
  CheckJacobian(*term, false,
                [](Draw& draw) { return Blocks{draw.Point(0.7) + Vector3d(1.0, 2.0, 1.0)}; });
  EXPECT_NEAR(Residuals(*term, {Vector3d(1.6, 1.2, 0.9)})[0], 2.0 * 0.5, 1e-12);
  EXPECT_EQ(Residuals(*term, {Vector3d(1.2, 2.0, 0.9)})[0], 0.0);
  EXPECT_EQ(Residuals(*term, {Vector3d(1.0, 2.0, 0.9)})[0], 0.0) << "right above it";
}

TEST(StandingBalance, CountsHowFarMassIsFromTheFeet) {
  constexpr std::size_t kMasses = kBalanceMasses.size();
  double sum = 0.0;
  for (const auto& [joint, mass] : kBalanceMasses) {
    EXPECT_GE(joint, 0);
    EXPECT_LT(joint, 22);
    EXPECT_GT(mass, 0.0);
    sum += mass;
  }
  EXPECT_NEAR(sum, 1.0, 1e-12) << "a whole person";

  constexpr int kCount = static_cast<int>(kMasses + kBalanceFeet.size());
  const MotionTerm term = StandingBalance(0.08, 4.0);
  CheckJacobian(*term, false, [](Draw& draw) { return Points(draw, kCount, 0.25); });
  // A leaning pole: all of the mass 20 cm in front of the feet, at any height.
  Blocks lean;
  for (int k = 0; k < kCount; ++k) {
    const bool foot = k >= static_cast<int>(kMasses);
    lean.emplace_back(Vector3d(1.0, foot ? 2.0 : 1.8, 0.1 * k));
  }
  EXPECT_NEAR(Residuals(*term, lean)[0], 2.0 * 0.12, 1e-12);
  for (VectorXd& point : lean) point.head<2>() = Eigen::Vector2d(1.0, 2.0);
  EXPECT_EQ(Residuals(*term, lean)[0], 0.0);
  // It does not matter where that is.
  for (VectorXd& point : lean) point += Vector3d(5, -3, 0);
  EXPECT_EQ(Residuals(*term, lean)[0], 0.0);
}

}  // namespace
}  // namespace holdfast
