// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "solver/grasp/grasp_candidates.h"
#include "solver/grasp/grasp_placement.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/hand_scene.h"

namespace holdfast {
namespace {

using testing::DefaultHand;

struct HeldThing {
  explicit HeldThing(TriangleMesh m)
      : mesh(std::move(m)), surface(mesh), grid(surface, {.cell_m = 0.0025, .threads = 2}) {}
  explicit HeldThing(const std::string& name)
      : HeldThing(ReadMesh(std::string(HOLDFAST_MESHES_DIR "/objects/") + name + ".ply")) {}
  TriangleMesh mesh;
  SignedDistance surface;
  DistanceGrid grid;
};

// A cheaper search: enough for simple objects.
GraspOptions Quick() {
  GraspOptions options;
  options.oppositions = 24;
  options.closings = 60;
  options.refinements = 12;
  options.threads = 2;
  return options;
}

Grasp Close(Side side, const HeldThing& object, const GraspOptions& options,
            GraspReport* report = nullptr) {
  return CloseHand(DefaultHand(side), object.mesh, object.surface, object.grid, options, report);
}

// What makes a grasp a grasp, by exact distances and independent of the search's own numbers.
void ExpectClean(Side side, const HeldThing& object, const Grasp& grasp) {
  const HandModel& hand = DefaultHand(side);
  const HandAnatomy anatomy(hand);
  HandEvaluation evaluation = AtWrist(hand);
  const Eigen::Matrix3Xd vertices = evaluation.At(grasp.fingers.data(), false).Vertices();
  const Eigen::VectorXd distance =
      object.surface.Distances(grasp.wrist_from_object.inverse() * vertices);
  EXPECT_GT(distance.minCoeff(), -0.0025) << "a vertex is inside";
  EXPECT_LT(SelfPenetration(anatomy.landmarks, vertices), 0.004);
  EXPECT_LT(anatomy.axes.LimitExcess(anatomy.axes.AnglesOf(grasp.fingers)), 1.0 * kDegree);

  std::array<bool, kNumFingers> touching{};
  for (int part = 0; part < kPalmPart; ++part) {
    for (const int i : anatomy.landmarks.Pad(part)) {
      if (distance(i) < 0.0025) touching[part / 3] = true;
    }
  }
  EXPECT_TRUE(touching[kThumb]);
  EXPECT_GE(std::count(touching.begin(), touching.begin() + kThumb, true), 2);
  EXPECT_GT(grasp.wrench_quality, 0.0);

  // The object's own surface stays out of the hand: nothing thin slips between vertices.
  const SignedDistance solid(CloseHoles({vertices, hand.Surface().Faces()}));
  double deepest = 0.0;
  for (Eigen::Index i = 0; i < object.mesh.NumVertices(); ++i) {
    deepest =
        std::max(deepest, -solid.Distance(grasp.wrist_from_object * object.mesh.vertices.col(i)));
  }
  EXPECT_LT(deepest, 0.004);
}

struct Case {
  const char* object;
  Side side;
};

class GraspOf : public ::testing::TestWithParam<Case> {};

TEST_P(GraspOf, IsClean) {
  const auto& [name, side] = GetParam();
  const HeldThing object{std::string(name)};
  GraspOptions options;
  options.threads = 2;
  GraspReport report;
  const Grasp grasp = Close(side, object, options, &report);
  ASSERT_EQ(report.status, GraspStatus::kFound) << Describe(report.status);
  ExpectClean(side, object, grasp);
  EXPECT_LT(grasp.metrics.max_penetration_mm, 2.5);
  EXPECT_GT(grasp.metrics.contact_ratio, 0.02);
}

INSTANTIATE_TEST_SUITE_P(
    Objects, GraspOf,
    ::testing::Values(Case{"sphere", Side::kRight}, Case{"cylinder", Side::kLeft},
                      Case{"bottle", Side::kRight}, Case{"mug", Side::kRight},
                      Case{"phone", Side::kLeft}, Case{"hammer", Side::kRight},
                      Case{"bowl", Side::kRight}, Case{"toothbrush", Side::kRight}),
    [](const auto& test) {
      return std::string(test.param.object) + "_" + std::string(SideName(test.param.side));
    });

TEST(IsWithinSpan, OfWallsAndHandlesAndNotOfBoulders) {
  const TriangleMesh boulder = testing::Box({0, 0, 0}, {1.5, 1.5, 1.2});
  EXPECT_FALSE(IsWithinSpan(boulder, 0.105));
  EXPECT_TRUE(IsWithinSpan(boulder, 1.3));
  EXPECT_TRUE(IsWithinSpan(testing::Box({0, 0, 0}, {1.5, 1.5, 0.01}), 0.105));
  // A bar along one side, as wide as a hand likes it.
  TriangleMesh chest =
      testing::Together(boulder, testing::Box({1.55, 0.7, 1.0}, {1.57, 0.9, 1.02}));
  EXPECT_TRUE(IsWithinSpan(chest, 0.105));
  // However its faces are turned.
  chest.faces.row(0).swap(chest.faces.row(1));
  EXPECT_TRUE(IsWithinSpan(chest, 0.105));
}

TEST(CloseHand, IsTheSameOnAnyNumberOfThreads) {
  const HeldThing object(std::string("cylinder"));
  GraspOptions options = Quick();
  options.threads = 1;
  const Grasp one = Close(Side::kRight, object, options);
  options.threads = 2;
  const Grasp two = Close(Side::kRight, object, options);
  EXPECT_EQ(one.fingers, two.fingers);
  EXPECT_EQ(one.wrist_from_object.matrix(), two.wrist_from_object.matrix());
  EXPECT_EQ(one.score, two.score);
  const Grasp again = Close(Side::kRight, object, options);
  EXPECT_EQ(two.fingers, again.fingers);
}

TEST(CloseHand, BestOnlyFindsTheSameAndReportsLess) {
  const HeldThing object(std::string("cylinder"));
  GraspOptions options = Quick();
  options.refinements = 24;
  GraspReport all, best_only;
  const Grasp best = Close(Side::kRight, object, options, &all);
  options.best_only = true;
  const Grasp same = Close(Side::kRight, object, options, &best_only);
  EXPECT_EQ(best.score, same.score);
  EXPECT_EQ(best.fingers, same.fingers);
  EXPECT_LT(best_only.candidates.size(), all.candidates.size());
}

TEST(CloseHand, PrefersWhatStaysUpright) {
  const HeldThing object(std::string("cylinder"));
  const HandAxes axes(DefaultHand(Side::kRight));
  GraspOptions options = Quick();
  options.up_in_wrist = {axes.Across()};
  const Grasp grasp = Close(Side::kRight, object, options);
  EXPECT_GT(grasp.upright, 0.8);
  EXPECT_NEAR(grasp.upright, axes.Across().dot(grasp.wrist_from_object.linear().col(2)), 1e-12);
}

TEST(CloseHand, SaysSoWhenAnObjectIsTooLarge) {
  TriangleMesh boulder = ReadMesh(HOLDFAST_MESHES_DIR "/objects/sphere.ply");
  boulder.vertices *= 10.0;
  const SignedDistance surface(boulder);
  const DistanceGrid grid(surface, {.cell_m = 0.02, .threads = 2});
  GraspReport report;
  CloseHand(DefaultHand(Side::kRight), boulder, surface, grid, Quick(), &report);
  EXPECT_EQ(report.status, GraspStatus::kNothingToGrasp);
}

TEST(CloseHand, StopsWhenAsked) {
  const HeldThing object(std::string("cylinder"));
  int calls = 0;
  GraspReport report;
  CloseHand(DefaultHand(Side::kRight), object.mesh, object.surface, object.grid, Quick(), &report,
            [&](double share) {
              EXPECT_GE(share, 0.0);
              EXPECT_LE(share, 1.0);
              return ++calls < 3;
            });
  EXPECT_LT(calls, 10);
  EXPECT_EQ(report.status, GraspStatus::kStopped);
}

TEST(CloseHand, GoesWithTheWrist) {
  Grasp grasp;
  grasp.wrist_from_object.translation() = Eigen::Vector3d(0.1, 0.2, 0.3);
  const Eigen::Matrix3d R = ExpSO3(Eigen::Vector3d(0.3, -0.4, 0.5));
  const Eigen::Vector3d p(1.0, 2.0, 3.0);
  const Eigen::Isometry3d world = ObjectInWorld(grasp, R, p);
  EXPECT_LT((world.translation() - (R * Eigen::Vector3d(0.1, 0.2, 0.3) + p)).norm(), 1e-15);
  EXPECT_LT((world.linear() - R).norm(), 1e-15);
}

TEST(PinchHand, PadsFaceEachOtherAtTheWidthAsked) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const HandAnatomy anatomy(DefaultHand(side));
    HandEvaluation evaluation = AtWrist(DefaultHand(side));
    for (const double width : {0.03, 0.06, 0.09}) {
      const HandAngles angles = PinchHand(anatomy, width);
      EXPECT_EQ(anatomy.axes.LimitExcess(angles), 0.0);
      const FingerPose pose = anatomy.axes.PoseOf(angles);
      const HandState& state = evaluation.At(pose.data(), false);
      const auto pad = [&](int finger) -> Eigen::Vector3d {
        return state.Vertices().col(anatomy.landmarks.PadCenter(finger));
      };
      EXPECT_NEAR((0.5 * (pad(kIndex) + pad(kMiddle)) - pad(kThumb)).norm(), width, 0.006);
      const Eigen::Vector3d thumb =
          state.JointRotation(3 * kThumb + 2) * anatomy.axes.PadDirection(3 * kThumb + 2);
      const Eigen::Vector3d index =
          state.JointRotation(3 * kIndex + 2) * anatomy.axes.PadDirection(3 * kIndex + 2);
      EXPECT_LT(thumb.dot(index), -0.3);
    }
  }
}

TEST(PinchHand, LeftIsTheMirrorOfRight) {
  const HandAngles right = PinchHand(HandAnatomy(DefaultHand(Side::kRight)), 0.05);
  const HandAngles left = PinchHand(HandAnatomy(DefaultHand(Side::kLeft)), 0.05);
  EXPECT_LT((right - left).cwiseAbs().maxCoeff(), 2.0 * kDegree);
}

TEST(CloseFingers, StopsAtTheSurfaceAndMirrors) {
  const HeldThing object(std::string("sphere"));
  Closing closings[2];
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const HandAnatomy anatomy(DefaultHand(side));
    HandEvaluation evaluation = AtWrist(DefaultHand(side));
    Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();
    const double radius = 0.5 * Extent(object.mesh).x();
    wrist_from_object.translation() = anatomy.landmarks.PalmCenter() +
                                      (radius + 0.004) * anatomy.axes.PalmNormal() +
                                      0.01 * anatomy.axes.Forward();
    const Closing closing =
        CloseFingers(anatomy, evaluation, object.grid, wrist_from_object, OpenHand(anatomy.axes));
    const FingerPose pose = anatomy.axes.PoseOf(closing.angles);
    const Eigen::VectorXd distance = object.surface.Distances(
        wrist_from_object.inverse() * evaluation.At(pose.data(), false).Vertices());
    EXPECT_GT(distance.minCoeff(), -0.003);
    EXPECT_GE(std::count(closing.finger_touching.begin(), closing.finger_touching.end(), true), 3);
    EXPECT_EQ(anatomy.axes.LimitExcess(closing.angles), 0.0);
    closings[side == Side::kLeft] = closing;
  }
  // A ball is its own mirror image (up to its triangles).
  EXPECT_LT((closings[0].angles - closings[1].angles).cwiseAbs().maxCoeff(), 8.0 * kDegree);
}

TEST(FindOppositions, AreOpposedPlacesOnTheSurface) {
  const HeldThing object(std::string("cylinder"));
  const std::vector<Opposition> found =
      FindOppositions(object.mesh, object.grid, SolidCentroid(object.mesh), {});
  ASSERT_GT(found.size(), 10u);
  for (const Opposition& opposition : found) {
    const Eigen::Vector3d half = 0.5 * opposition.width * opposition.axis;
    EXPECT_NEAR(object.surface.Distance(opposition.center + half), 0.0, 0.001);
    EXPECT_NEAR(object.surface.Distance(opposition.center - half), 0.0, 0.001);
    EXPECT_NEAR(opposition.axis.norm(), 1.0, 1e-9);
  }
  EXPECT_TRUE(std::is_sorted(found.begin(), found.end(),
                             [](const auto& a, const auto& b) { return a.quality > b.quality; }));
}

TEST(FindOppositions, SeeWallsAndWhatTheyEnclose) {
  const HeldThing mug(std::string("mug"));
  const std::vector<Opposition> found =
      FindOppositions(mug.mesh, mug.grid, SolidCentroid(mug.mesh), {});
  EXPECT_TRUE(
      std::any_of(found.begin(), found.end(), [](const auto& o) { return o.width < 0.02; }));
  EXPECT_TRUE(
      std::any_of(found.begin(), found.end(), [](const auto& o) { return o.width > 0.06; }));
}

TEST(WrenchQuality, NeedsOpposedContactsWithFriction) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY();
  const std::vector<GraspContact> same_side = {
      {-0.03 * x + 0.01 * y, x}, {-0.03 * x, x}, {-0.03 * x - 0.01 * y, x}};
  EXPECT_EQ(WrenchQuality(same_side, Eigen::Vector3d::Zero(), 0.03), 0.0);
  std::vector<GraspContact> three;
  for (int i = 0; i < 3; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 3.0;
    const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0.0);
    three.push_back({0.03 * out, -out});
  }
  const double quality = WrenchQuality(three, Eigen::Vector3d::Zero(), 0.03);
  EXPECT_GT(quality, 0.1);
  EXPECT_LT(quality, 1.2);
  // More friction holds harder; turning and scaling the scene changes nothing.
  EXPECT_GT(WrenchQuality(three, Eigen::Vector3d::Zero(), 0.03, 0.8), quality);
  for (GraspContact& contact : three) contact.point *= 2.0;
  EXPECT_NEAR(WrenchQuality(three, Eigen::Vector3d::Zero(), 0.06), quality, 0.02);
}

TEST(SolidCentroid, IsTheMiddleOfASolid) {
  const TriangleMesh cube = ReadMesh(HOLDFAST_MESHES_DIR "/objects/cube.ply");
  const Eigen::Vector3d middle =
      0.5 * (cube.vertices.rowwise().minCoeff() + cube.vertices.rowwise().maxCoeff());
  EXPECT_LT((SolidCentroid(cube) - middle).norm(), 1e-4);
}

}  // namespace
}  // namespace holdfast
