// SPDX-License-Identifier: MIT
#include <cmath>

#include <gtest/gtest.h>

#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/score/contact_metrics.h"
#include "solver/fit/hand_object_block.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/terms/hand/object_in_hand.h"
#include "solver/terms/hand/penetration.h"
#include "solver/unknowns/rotation_manifold.h"
#include "tests/support/hand_scene.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

using testing::HandScene;

// A ball pressed into the palm of a bent arm's hand.
struct Scene {
  explicit Scene(Side side, double above_palm_m = 0.03)
      : hand_scene(side),
        anatomy(hand_scene.hand),
        ball(ReadMesh(HOLDFAST_MESHES_DIR "/objects/sphere.ply")),
        surface(ball),
        grid(surface, {.cell_m = 0.004}),
        samples(SampleSurface(ball, 3000)),
        state(hand_scene.hand) {
    state.SetBody(hand_scene.pose, hand_scene.trans);
    fingers = FingersOf(hand_scene.pose, side);
    state.Evaluate(fingers, false);
    pose.orientation =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, -0.5, 0.8).normalized()));
    const Eigen::Matrix3d wrist = state.WristRotation();
    pose.translation = state.WristPosition() + wrist * (anatomy.landmarks.PalmCenter() +
                                                        above_palm_m * anatomy.axes.PalmNormal());
  }
  std::vector<double*> Parameters() {
    return {pose.orientation.coeffs().data(), pose.translation.data(), fingers.data()};
  }
  Eigen::Matrix3Xd Z() {
    state.Evaluate(fingers, false);
    return InObjectFrame(state.Vertices(), pose.orientation, pose.translation);
  }

  HandScene hand_scene;
  HandAnatomy anatomy;
  TriangleMesh ball;
  SignedDistance surface;
  DistanceGrid grid;
  Eigen::Matrix3Xd samples;
  HandState state;
  FingerPose fingers;
  ObjectPose pose;
};

// The block's gradient against central differences of its cost, in the tangent.
void ExpectGradientMatches(Scene& scene, SkinTerm& term) {
  HandObjectBlock block(&scene.state);
  block.AddTerm(EnergyTerm::kPenetration, &term);
  block.Watch(scene.Parameters().data());
  HandObjectBlock::System system;
  block.Linearize(scene.Parameters().data(), system);
  ASSERT_GT(system.gradient.norm(), 0.0);
  const RotationManifold manifold;
  const Eigen::VectorXd numeric =
      testing::CostGradientAt(block, scene.Parameters(), {&manifold}, 1e-8);
  for (int k = 0; k < HandObjectBlock::kTangent; ++k) {
    EXPECT_NEAR(system.gradient(k), numeric(k), 2e-5 * system.gradient.norm()) << k;
  }
  // The Gauss-Newton matrix is that of the rows: J^T r of 52 rows is the same gradient.
  const auto [r, J] = testing::RowsAt(block, scene.Parameters().data(), {&manifold});
  EXPECT_NEAR(0.5 * r.squaredNorm(), system.cost, 1e-9 * system.cost);
  EXPECT_LT((J.transpose() * r - system.gradient).tail<kHandDofs>().norm(),
            1e-6 * system.gradient.norm());
}

class SkinTermsOf : public ::testing::TestWithParam<Side> {};
INSTANTIATE_TEST_SUITE_P(Sides, SkinTermsOf, ::testing::Values(Side::kRight, Side::kLeft),
                         [](const auto& side) { return std::string(SideName(side.param)); });

TEST_P(SkinTermsOf, PenetrationGradientMatchesDifferences) {
  Scene scene(GetParam());
  Penetration term(scene.anatomy.landmarks, scene.grid, 0.0005, 3000.0);
  ExpectGradientMatches(scene, term);
}

TEST_P(SkinTermsOf, ObjectInHandGradientMatchesDifferences) {
  // Shallow: deep inside, samples lie between two sides of a finger, where the depth has a kink.
  Scene scene(GetParam(), 0.036);
  ObjectInHand term(scene.hand_scene.hand, scene.samples, 0.0005, 3000.0);
  ExpectGradientMatches(scene, term);
  EXPECT_GT(term.NumWatched(), 50u);
}

TEST_P(SkinTermsOf, PenetrationIsTheDepthBelowWhatSoftTissueGives) {
  Scene scene(GetParam());
  const double give = 0.002;
  Penetration term(scene.anatomy.landmarks, scene.grid, give, 7.0);
  const Eigen::Matrix3Xd z = scene.Z();
  term.Watch(z);
  SkinRows rows;
  const double energy = term.Add(z, rows);
  double expected = 0.0;
  std::size_t deeper = 0;
  for (const SkinPoint& point : scene.anatomy.landmarks.Skin()) {
    const double depth = -scene.grid.Distance(0.5 * (z.col(point.a) + z.col(point.b))) - give;
    if (depth <= 0.0) continue;
    expected += depth * depth;
    ++deeper;
  }
  ASSERT_GT(deeper, 10u);
  EXPECT_EQ(rows.Size(), deeper);
  EXPECT_NEAR(energy, expected, 1e-12);
  double cost = 0.0;
  for (std::size_t k = 0; k < rows.Size(); ++k) cost += rows.Residual(k) * rows.Residual(k);
  EXPECT_NEAR(cost, 7.0 * energy, 1e-12);
}

TEST_P(SkinTermsOf, ObjectInHandIsTheDepthBelowTheSkin) {
  Scene scene(GetParam());
  const double give = 0.0005;
  ObjectInHand term(scene.hand_scene.hand, scene.samples, give, 1.0);
  const Eigen::Matrix3Xd z = scene.Z();
  term.Watch(z);
  SkinRows rows;
  term.Add(z, rows);
  const SignedDistance skin(CloseHoles({z, scene.hand_scene.hand.Surface().Faces()}));
  const Eigen::VectorXd distance = skin.Distances(scene.samples);
  // Depths beside the cut at the wrist are left out by the term; the rest agree.
  double deepest = 0.0;
  for (std::size_t k = 0; k < rows.Size(); ++k) deepest = std::max(deepest, rows.Residual(k));
  EXPECT_NEAR(deepest, -distance.minCoeff() - give, 2e-4);
  EXPECT_NEAR(static_cast<double>(rows.Size()),
              static_cast<double>((distance.array() < -give).count()),
              0.05 * static_cast<double>(rows.Size()) + 3.0);
}

TEST_P(SkinTermsOf, NothingIsSaidOfAHandThatIsFree) {
  Scene scene(GetParam());
  scene.pose.translation += Eigen::Vector3d(0.0, 0.0, 0.3);
  Penetration penetration(scene.anatomy.landmarks, scene.grid, 0.0, 1.0);
  ObjectInHand object_in_hand(scene.hand_scene.hand, scene.samples, 0.0, 1.0);
  const Eigen::Matrix3Xd z = scene.Z();
  SkinRows rows;
  for (SkinTerm* term :
       {static_cast<SkinTerm*>(&penetration), static_cast<SkinTerm*>(&object_in_hand)}) {
    term->Watch(z);
    EXPECT_EQ(term->Add(z, rows), 0.0);
  }
  EXPECT_EQ(rows.Size(), 0u);
}

}  // namespace
}  // namespace holdfast
