// SPDX-License-Identifier: MIT
#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "geometry/object/load_object.h"
#include "solver/terms/body/goal_terms.h"
#include "solver/terms/body/marker_terms.h"
#include "solver/terms/body/posture_terms.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

using testing::JacobianError;
using testing::ResidualsAt;

Eigen::VectorXd Random(std::mt19937& random, Eigen::Index size, double scale) {
  std::normal_distribution<double> normal(0.0, scale);
  Eigen::VectorXd x(size);
  for (double& value : x) value = normal(random);
  return x;
}

// An arm, spine and fingers free; markers on spine, wrist, elbow, index finger; that of the spine
// moves with collar and neck too.
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
  body.shares = {{{kSpine3, 0.5}, {kRightShoulder, 0.3}, {kNeck, 0.2}}, {}, {}, {}};
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
      seen.place.col(k) =
          body.Carry(state.Body(), body.RestJoints(betas.data()), m, places.segment<3>(3 * m)) +
          off_m * Random(random, 3, 1.0).normalized();
    }
    return seen;
  }
  double ErrorAt(double off_m) {
    double worst = 0.0;
    const std::vector<SeenMarkers> groups = ByJoint(body, At(off_m));
    EXPECT_EQ(groups.size(), 3u);
    for (const SeenMarkers& seen : groups) {
      const MarkerDistance term(body, seen, 0.02);
      const std::vector<double*> blocks =
          term.Blocks(root.data(), q.data(), betas.data(), places.data());
      worst = std::max(worst, JacobianError(term, blocks));
    }
    return worst;
  }
};

TEST_F(MarkerDistanceTest, JacobianIsThatOfDifferencesNearAndFar) {
  for (const double off : {1e-5, 0.01, 0.3}) EXPECT_LT(ErrorAt(off), 1e-5) << off;
}

TEST_F(MarkerDistanceTest, IsZeroOnThePlaceAndGrowsLikeALogarithm) {
  const auto norm = [&](double off) {
    const MarkerDistance term(body, ByJoint(body, At(off))[0], 0.02);
    return ResidualsAt(term, term.Blocks(root.data(), q.data(), betas.data(), places.data()).data())
        .norm();
  };
  EXPECT_NEAR(norm(0.0), 0.0, 1e-12);
  EXPECT_NEAR(norm(0.001), 0.1, 1e-3);
  EXPECT_NEAR(norm(0.2), 2.0 * std::sqrt(std::log(101.0)), 1e-6);
}

// Without shares a marker goes with its joint; with them as linear blend skinning takes it.
TEST_F(MarkerDistanceTest, CarriesMarkersAsTheSkin) {
  FreePoseState state;
  const Eigen::Matrix3Xd rest = body.RestJoints(betas.data());
  state.Evaluate(body.free, rest, root.data(), q.data(), false);
  const Eigen::Vector3d place(0.01, 0.02, 0.03);
  EXPECT_LT((body.Carry(state.Body(), rest, 1, place) - state.Point(kRightWrist, place)).norm(),
            1e-12);
  Eigen::Vector3d skinned = Eigen::Vector3d::Zero();
  for (const auto& [joint, share] : body.shares[0]) {
    const Eigen::Vector3d x = rest.col(kSpine3) + place;
    skinned +=
        share * (state.Body().world_rotation[joint] * x + state.Body().skin_offset.col(joint));
  }
  EXPECT_LT((body.Carry(state.Body(), rest, 0, place) - skinned).norm(), 1e-12);
}

TEST(MarkerPlacePrior, JacobianIsThatOfDifferences) {
  std::mt19937 random(3);
  Eigen::Matrix3Xd J(3, 2);
  for (int k = 0; k < 2; ++k) J.col(k) = Random(random, 3, 0.1);
  const MarkerPlacePrior term(Random(random, 3, 0.1), J, 0.01);
  Eigen::VectorXd betas = Random(random, 2, 1.0), place = Random(random, 3, 0.1);
  EXPECT_LT(JacobianError(term, {betas.data(), place.data()}), 1e-6);
}

// A roof of two triangles; shape raises it and turns it.
TEST(MarkerOnSkin, MeasuresHeightAndItsJacobianIsThatOfDifferences) {
  std::mt19937 random(9);
  SkinPatch patch;
  patch.vertices.resize(3, 4);
  patch.vertices << -0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.1, -0.1, 0.0, 0.0, 0.05, 0.05;
  patch.faces.resize(3, 2);
  patch.faces << 0, 3, 3, 1, 2, 2;
  patch.J_betas = Eigen::MatrixXd(12, 2);
  for (int k = 0; k < 2; ++k) patch.J_betas.col(k) = Random(random, 12, 0.01);
  const MarkerOnSkin term(patch, 0.003);
  Eigen::Vector2d betas(0.0, 0.0);
  double height = 0.008;
  const auto residual = [&](const Eigen::Vector3d& place) {
    return ResidualsAt(term, {betas.data(), &height, place.data()})[0];
  };
  const Eigen::Vector3d slope(-0.02, 0.0, 0.04),
      out = Eigen::Vector3d(-0.05, 0.0, 0.1).normalized();
  EXPECT_NEAR(residual(slope + 0.008 * out), 0.0, 1e-9);
  EXPECT_NEAR(residual(slope - 0.002 * out), -0.010 / 0.003, 1e-9);
  betas = Eigen::Vector2d(0.4, -0.7);
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(-0.02, 0.01, 0.06),    // over a triangle
                                    Eigen::Vector3d(0.03, 0.02, 0.01),     // below
                                    Eigen::Vector3d(-0.14, 0.0, 0.01)}) {  // beyond a corner
    Eigen::Vector3d place = at;
    EXPECT_LT(JacobianError(term, {betas.data(), &height, place.data()}), 1e-5) << at.transpose();
  }
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
  EXPECT_LT(JacobianError(term, {q.data()}), 1e-6);
  const Eigen::VectorXd r = ResidualsAt(term, {q.data()});
  EXPECT_NEAR(r(5), 0.6 / 0.05, 1e-9);
  EXPECT_EQ(r(6), 0.0);
  EXPECT_NEAR(r(7), -0.4 / 0.05, 1e-9);
}

TEST(PoseAcceleration, IsZeroForEvenMotionAndItsJacobianThatOfDifferences) {
  std::mt19937 random(5);
  const PoseAcceleration term(Eigen::Vector3d(0.1, 0.2, 0.4));
  Eigen::VectorXd a = Random(random, 3, 1.0), step = Random(random, 3, 0.1), b = a + step,
                  c = b + step;
  const Eigen::VectorXd r = ResidualsAt(term, {a.data(), b.data(), c.data()});
  EXPECT_LT(r.norm(), 1e-12);
  c(1) += 0.3;
  EXPECT_LT(JacobianError(term, {a.data(), b.data(), c.data()}), 1e-6);
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
  const Eigen::VectorXd r = ResidualsAt(term, {q.data()});
  EXPECT_LT(r.head<5>().norm(), 1e-9);
  EXPECT_NEAR(r(5), 23.0, 0.5);  // with the margin, millimeters
}

TEST_F(HeadPlaceTest, JacobianIsThatOfDifferences) {
  const HeadPlace::Head head{*skin, Eigen::Vector3d(0.0, 0.02, 0.1)};
  Eigen::Matrix3Xd points(3, 4);
  for (int k = 0; k < 4; ++k) points.col(k) = 0.085 * Random(random, 3, 1.0).normalized();
  const HeadPlace term(free, rest_joints, root, head, Eigen::Vector3d(0.1, 0.2, 0.3),
                       Head() * points);
  EXPECT_LT(JacobianError(term, {q.data()}), 1e-4);
}

TEST(PelvisUpright, IsZeroUprightAndItsJacobianThatOfDifferences) {
  const PelvisUpright term(0.1);
  Eigen::VectorXd root = Eigen::VectorXd::Zero(6);
  root.tail<3>() = LogSO3(ExpSO3(Eigen::Vector3d::UnitZ() * 0.7) *
                          ExpSO3(Eigen::Vector3d::UnitX() * 90.0 * kDegree));
  const Eigen::VectorXd r = ResidualsAt(term, {root.data()});
  EXPECT_LT(r.norm(), 1e-9);
  std::mt19937 random(6);
  root += Random(random, 6, 0.3);
  EXPECT_LT(JacobianError(term, {root.data()}), 1e-6);
}

}  // namespace
}  // namespace holdfast
