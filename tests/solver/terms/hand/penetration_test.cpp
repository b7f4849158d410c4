// SPDX-License-Identifier: MIT
#include "solver/terms/hand/penetration.h"

#include <cmath>

#include <gtest/gtest.h>

#include "geometry/io/mesh/mesh_io.h"
#include "solver/grasp/finger_closing.h"
#include "solver/terms/hand/hand_prior.h"
#include "solver/terms/hand/vertex_goals.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

// A hand at the wrist's origin with a ball where its fingers curl.
struct Scene {
  explicit Scene(Side side)
      : hand(BodyModel::Default(), {}, side),
        anatomy(hand),
        evaluation(AtWrist(hand)),
        ball(ReadMesh(HOLDFAST_MESHES_DIR "/objects/sphere.ply")),
        surface(ball),
        grid(surface, {.cell_m = 0.004}) {
    fingers = anatomy.axes.PoseOf(PinchHand(anatomy, 0.05));
    translation = anatomy.landmarks.PalmCenter() + 0.035 * anatomy.axes.PalmNormal();
    rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, -0.5, 0.8).normalized()));
  }

  std::vector<double*> Parameters() {
    return {rotation.coeffs().data(), translation.data(), fingers.data()};
  }

  Eigen::VectorXd Residuals(const ceres::CostFunction& cost) {
    return testing::ResidualsAt(cost, Parameters().data());
  }
  double JacobianError(const ceres::CostFunction& cost) {
    const RotationManifold manifold;
    return testing::JacobianError(cost, Parameters(), {&manifold});
  }

  HandModel hand;
  HandAnatomy anatomy;
  HandEvaluation evaluation;
  TriangleMesh ball;
  SignedDistance surface;
  DistanceGrid grid;
  Eigen::Quaterniond rotation;
  Eigen::Vector3d translation;
  FingerPose fingers;
};

class EitherHand : public ::testing::TestWithParam<Side> {};
INSTANTIATE_TEST_SUITE_P(Sides, EitherHand, ::testing::Values(Side::kRight, Side::kLeft),
                         [](const auto& side) { return std::string(SideName(side.param)); });

// Skin points well to one side of the hinge's corner, where differences see one branch only.
std::vector<SkinPoint> Below(Scene& scene, double clearance) {
  std::vector<SkinPoint> points;
  const Eigen::Matrix3Xd& vertices = scene.evaluation.At(scene.fingers.data(), false).Vertices();
  for (const SkinPoint& point : scene.anatomy.landmarks.Skin()) {
    const Eigen::Vector3d x = 0.5 * (vertices.col(point.a) + vertices.col(point.b));
    const double d = scene.grid.Distance(scene.rotation.conjugate() * (x - scene.translation));
    if (std::abs(d - clearance) > 1e-4 && d < clearance + 0.01) points.push_back(point);
  }
  return points;
}

TEST_P(EitherHand, PenetrationJacobianMatchesDifferences) {
  Scene scene(GetParam());
  const std::vector<SkinPoint> points = Below(scene, 0.02);
  ASSERT_GT(points.size(), 100u);
  const PenetrationTerm term(scene.evaluation, scene.grid, points, {3.0, 0.02});
  EXPECT_LT(scene.JacobianError(term), 1e-5);
}

TEST_P(EitherHand, ContactJacobianMatchesDifferences) {
  Scene scene(GetParam());
  const GraspContactTerm term(scene.evaluation, scene.grid, Below(scene, 0.02), {3.0, -0.001});
  EXPECT_LT(scene.JacobianError(term), 1e-5);
}

TEST_P(EitherHand, FingerCollisionJacobianMatchesDifferences) {
  Scene scene(GetParam());
  // Everything counts as too close, so that no pair sits on the corner.
  std::vector<HandLandmarks::BallPair> pairs = scene.anatomy.landmarks.BallPairs();
  for (HandLandmarks::BallPair& pair : pairs) pair.free_distance = 0.5;
  const FingerCollisionTerm term(scene.evaluation, scene.anatomy.landmarks, pairs, 2.0);
  EXPECT_LT(testing::JacobianError(term, {scene.fingers.data()}), 1e-6);
}

TEST_P(EitherHand, IntrusionIsHowFarThePointIsBelowTheSkin) {
  Scene scene(GetParam());
  const Eigen::Matrix3Xd& vertices = scene.evaluation.At(scene.fingers.data(), false).Vertices();
  const Eigen::Matrix3Xi& faces = scene.hand.Surface().Faces();
  std::vector<Intrusion> intrusions;
  for (Eigen::Index f = 0; f < faces.cols(); f += 40) {
    Intrusion in{{}, {faces(0, f), faces(1, f), faces(2, f)}, {0.2, 0.3, 0.5}, {}};
    Eigen::Vector3d skin = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) skin += in.shares[k] * vertices.col(in.corners[k]);
    in.outward = Eigen::Vector3d(std::cos(f), std::sin(f), 0.5).normalized();
    const double depth = f % 80 == 0 ? 0.002 : -0.001;
    in.point = scene.rotation.conjugate() * (skin - depth * in.outward - scene.translation);
    intrusions.push_back(in);
  }
  const IntrusionTerm term(scene.evaluation, intrusions, 3.0);
  const Eigen::VectorXd residuals = scene.Residuals(term);
  for (Eigen::Index j = 0; j < residuals.size(); ++j) {
    EXPECT_NEAR(residuals(j), j % 2 == 0 ? 0.006 : 0.0, 1e-12);
  }
  EXPECT_LT(scene.JacobianError(term), 1e-6);
}

TEST(Penetration, CountsDepthInsideAndNothingOutside) {
  Scene scene(Side::kRight);
  const std::vector<SkinPoint>& skin = scene.anatomy.landmarks.Skin();
  const PenetrationTerm term(scene.evaluation, scene.grid, skin, {2.0, 0.0});
  const Eigen::VectorXd residuals = scene.Residuals(term);
  const Eigen::Matrix3Xd& vertices = scene.evaluation.At(scene.fingers.data(), false).Vertices();
  int inside = 0;
  for (int i = 0; i < scene.hand.NumVertices(); ++i) {
    const double d =
        scene.surface.Distance(scene.rotation.conjugate() * (vertices.col(i) - scene.translation));
    EXPECT_NEAR(residuals(i), 2.0 * std::max(0.0, -d), 2.0 * (2e-4 + 0.03 * std::abs(d)));
    inside += d < 0.0;
  }
  EXPECT_GT(inside, 0);  // or the test says nothing
}

// What a term remembers of where the hand was changes nothing.
TEST(Penetration, IsTheSameFromWhereverTheHandComes) {
  Scene scene(Side::kRight);
  const std::vector<SkinPoint>& skin = scene.anatomy.landmarks.Skin();
  const PenetrationTerm term(scene.evaluation, scene.grid, skin, {2.0, 0.0});
  const Eigen::Vector3d there = scene.translation;
  int inside = 0;
  for (const double away : {0.03, 0.008, 0.004, 0.002, 0.0, -0.001, 0.001}) {
    scene.translation = there + away * Eigen::Vector3d::UnitX();
    const Eigen::VectorXd values = scene.Residuals(term);
    EXPECT_EQ(values,
              scene.Residuals(PenetrationTerm(scene.evaluation, scene.grid, skin, {2.0, 0.0})));
    inside += (values.array() > 0.0).any();
  }
  EXPECT_GT(inside, 0);
}

TEST(Penetration, ClearanceIsAMarginAndAnAllowance) {
  const PenetrationShape margin{1.0, 0.002}, allowance{1.0, -0.001};
  EXPECT_DOUBLE_EQ(margin(0.001).first, 0.001);
  EXPECT_DOUBLE_EQ(margin(0.003).first, 0.0);
  EXPECT_DOUBLE_EQ(allowance(-0.0005).first, 0.0);
  EXPECT_DOUBLE_EQ(allowance(-0.003).first, 0.002);
  EXPECT_DOUBLE_EQ(allowance(-0.003).second, -1.0);
}

TEST(GraspContact, DrawsFromEitherSide) {
  const GraspContactShape shape{10.0, -0.001};
  EXPECT_DOUBLE_EQ(shape(0.0).first, 0.01);
  EXPECT_DOUBLE_EQ(shape(-0.002).first, -0.01);
  EXPECT_DOUBLE_EQ(shape(-0.001).first, 0.0);
}

}  // namespace
}  // namespace holdfast
