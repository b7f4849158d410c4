// SPDX-License-Identifier: MIT
#include <random>

#include <gtest/gtest.h>

#include "geometry/io/mesh/load_object.h"
#include "solver/terms/body/head_place.h"
#include "solver/terms/body/marker_distance.h"
#include "solver/terms/body/marker_place.h"
#include "solver/terms/body/pelvis_upright.h"
#include "solver/terms/body/pose_acceleration.h"
#include "solver/terms/body/pose_rest.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

using testing::JacobianError;

Eigen::VectorXd Random(std::mt19937& random, Eigen::Index size, double scale) {
  std::normal_distribution<double> normal(0.0, scale);
  Eigen::VectorXd x(size);
  for (double& value : x) value = normal(random);
  return x;
}

// An arm, spine and fingers free; markers on spine, wrist, elbow, index finger.
MarkedBody SomeBody(std::mt19937& random) {
  const BodySurface surface(BodyModel::Default());
  MarkedBody body;
  body.rest_joints = surface.RestJoints();
  body.J_rest = Eigen::MatrixXd(3 * kNumJoints, 3);
  for (int k = 0; k < 3; ++k) body.J_rest.col(k) = Random(random, 3 * kNumJoints, 0.02);
  FreePose::Hand hand;
  hand.side = Side::kRight;
  hand.synergies = Eigen::MatrixXd(kHandDofs, 2);
  for (int k = 0; k < 2; ++k) hand.synergies.col(k) = Random(random, kHandDofs, 0.5);
  JointPose rest = JointPose::Zero();
  rest(2, kRightHandBegin) = 0.3;
  body.free = FreePose(rest, {kSpine1, kSpine3, kRightShoulder, kRightElbow, kRightWrist}, {hand});
  body.joint = {kSpine3, kRightWrist, kRightElbow, kRightHandBegin + 2};
  return body;
}

struct MarkerDistanceTest : ::testing::Test {
  std::mt19937 random{7};
  MarkedBody body = SomeBody(random);
  Eigen::VectorXd root = Random(random, 6, 0.6), q = Random(random, body.free.Size(), 0.5),
                  betas = Random(random, 3, 1.0), places = Random(random, 12, 0.05);

  SeenMarkers At(double off_m) {
    FreePoseState state;
    state.Evaluate(body.free, body.RestJoints(betas.data()), root.data(), q.data(), false);
    SeenMarkers seen;
    seen.marker = {0, 1, 3};
    seen.sigma_m = {0.01, 0.02, 0.01};
    seen.place.resize(3, 3);
    for (int k = 0; k < 3; ++k) {
      const int m = seen.marker[k];
      seen.place.col(k) = state.Point(body.joint[m], places.segment<3>(3 * m)) +
                          off_m * Random(random, 3, 1.0).normalized();
    }
    return seen;
  }
  double ErrorAt(double off_m) {
    const MarkerDistance term(body, At(off_m), 0.02);
    return JacobianError(term, {root.data(), q.data(), betas.data(), places.data()},
                         {nullptr, nullptr, nullptr, nullptr});
  }
};

TEST_F(MarkerDistanceTest, JacobianIsThatOfDifferencesNearAndFar) {
  for (const double off : {1e-5, 0.01, 0.3}) EXPECT_LT(ErrorAt(off), 1e-5) << off;
}

TEST_F(MarkerDistanceTest, IsZeroOnThePlaceAndGrowsLikeALogarithm) {
  const auto norm = [&](double off) {
    const MarkerDistance term(body, At(off), 0.02);
    Eigen::VectorXd r(9);
    const double* const x[] = {root.data(), q.data(), betas.data(), places.data()};
    EXPECT_TRUE(term.Evaluate(x, r.data(), nullptr));
    return r.head<3>().norm();
  };
  EXPECT_NEAR(norm(0.0), 0.0, 1e-12);
  EXPECT_NEAR(norm(0.001), 0.1, 1e-3);
  EXPECT_NEAR(norm(0.2), 2.0 * std::sqrt(std::log(101.0)), 1e-6);
}

TEST(MarkerPlacePrior, JacobianIsThatOfDifferences) {
  std::mt19937 random(3);
  Eigen::MatrixXd J(6, 2);
  for (int k = 0; k < 2; ++k) J.col(k) = Random(random, 6, 0.1);
  const MarkerPlacePrior term(Random(random, 6, 0.1), J, {0.01, 0.04});
  Eigen::VectorXd betas = Random(random, 2, 1.0), places = Random(random, 6, 0.1);
  EXPECT_LT(JacobianError(term, {betas.data(), places.data()}, {nullptr, nullptr}), 1e-6);
}

TEST(PoseRest, JacobianIsThatOfDifferencesWithinLimitsAndBeyond) {
  std::mt19937 random(4);
  Eigen::MatrixXd W(5, 5);
  for (int k = 0; k < 5; ++k) W.col(k) = Random(random, 5, 1.0);
  const std::vector<PoseLimit> limits = {{0, Eigen::Vector3d::UnitY(), -0.2, 0.3},
                                         {1, Eigen::Vector3d(0.6, 0.0, 0.8), -3.0, 3.0},
                                         {4, Eigen::VectorXd::Ones(1), 0.5, 1.0}};
  const PoseRest term(Random(random, 5, 0.3), W, limits, 0.05);
  Eigen::VectorXd q(5);
  q << 0.1, 0.9, -0.3, 0.2, 0.1;
  EXPECT_LT(JacobianError(term, {q.data()}, {nullptr}), 1e-6);
  Eigen::VectorXd r(8);
  const double* const x[] = {q.data()};
  ASSERT_TRUE(term.Evaluate(x, r.data(), nullptr));
  EXPECT_NEAR(r(5), 0.6 / 0.05, 1e-9);
  EXPECT_EQ(r(6), 0.0);
  EXPECT_NEAR(r(7), -0.4 / 0.05, 1e-9);
}

TEST(PoseAcceleration, IsZeroForEvenMotionAndItsJacobianThatOfDifferences) {
  std::mt19937 random(5);
  const PoseAcceleration term(Eigen::Vector3d(0.1, 0.2, 0.4));
  Eigen::VectorXd a = Random(random, 3, 1.0), step = Random(random, 3, 0.1), b = a + step,
                  c = b + step;
  const double* const even[] = {a.data(), b.data(), c.data()};
  Eigen::Vector3d r;
  ASSERT_TRUE(term.Evaluate(even, r.data(), nullptr));
  EXPECT_LT(r.norm(), 1e-12);
  c(1) += 0.3;
  EXPECT_LT(JacobianError(term, {a.data(), b.data(), c.data()}, {nullptr, nullptr, nullptr}), 1e-6);
}

// A ball of 10 cm for a head, about its joint.
struct HeadPlaceTest : ::testing::Test {
  HeadPlaceTest() {
    TriangleMesh ball = LoadObject("sphere").mesh;
    const Eigen::Vector3d middle =
        0.5 * (ball.vertices.rowwise().minCoeff() + ball.vertices.rowwise().maxCoeff());
    ball.vertices = 0.1 / 0.0335 * (ball.vertices.colwise() - middle);
    skin.emplace(SignedDistance(ball), DistanceGridOptions{.cell_m = 0.004, .padding_m = 0.05});
  }
  Eigen::Isometry3d Head() const {
    FreePoseState state;
    state.Evaluate(free, rest_joints, root.data(), q.data(), false);
    return state.Body().WorldFromJoint(kHead);
  }

  std::mt19937 random{8};
  std::optional<DistanceGrid> skin;
  const Eigen::Matrix3Xd rest_joints = BodySurface(BodyModel::Default()).RestJoints();
  const FreePose free{JointPose::Zero(), {kNeck, kHead}, {}};
  const Eigen::Matrix<double, 6, 1> root = Random(random, 6, 0.4);
  Eigen::VectorXd q = Random(random, 6, 0.4);
};

TEST_F(HeadPlaceTest, IsZeroWithLipsInPlaceAndNothingInTheHead) {
  const HeadPlace::Head head{*skin, Eigen::Vector3d(0.0, 0.02, 0.1)};
  Eigen::Matrix3Xd points(3, 3);
  points << 0.104, 0.0, 0.0, 0.0, 0.2, 0.08, 0.0, 0.0, 0.0;  // clear, clear, 20 mm deep
  const HeadPlace term(free, rest_joints, root, head, Head() * head.lips, Head() * points);
  Eigen::VectorXd r(6);
  const double* const x[] = {q.data()};
  ASSERT_TRUE(term.Evaluate(x, r.data(), nullptr));
  EXPECT_LT(r.head<5>().norm(), 1e-9);
  EXPECT_NEAR(r(5), 23.0, 0.5);  // with the margin, millimetres
}

TEST_F(HeadPlaceTest, JacobianIsThatOfDifferences) {
  const HeadPlace::Head head{*skin, Eigen::Vector3d(0.0, 0.02, 0.1)};
  Eigen::Matrix3Xd points(3, 4);
  for (int k = 0; k < 4; ++k) points.col(k) = 0.085 * Random(random, 3, 1.0).normalized();
  const HeadPlace term(free, rest_joints, root, head, Eigen::Vector3d(0.1, 0.2, 0.3),
                       Head() * points);
  EXPECT_LT(JacobianError(term, {q.data()}, {nullptr}), 1e-4);
}

TEST(PelvisUpright, IsZeroUprightAndItsJacobianThatOfDifferences) {
  const PelvisUpright term(0.1);
  Eigen::VectorXd root = Eigen::VectorXd::Zero(6);
  root.tail<3>() = LogSO3(ExpSO3(Eigen::Vector3d::UnitZ() * 0.7) *
                          ExpSO3(Eigen::Vector3d::UnitX() * 90.0 * kDegree));
  Eigen::Vector3d r;
  const double* const x[] = {root.data()};
  ASSERT_TRUE(term.Evaluate(x, r.data(), nullptr));
  EXPECT_LT(r.norm(), 1e-9);
  std::mt19937 random(6);
  root += Random(random, 6, 0.3);
  EXPECT_LT(JacobianError(term, {root.data()}, {nullptr}), 1e-6);
}

}  // namespace
}  // namespace holdfast
