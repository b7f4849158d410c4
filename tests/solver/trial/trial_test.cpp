// SPDX-License-Identifier: MIT
// What MuJoCo makes of hands whose answer is known.
#include "solver/trial/trial.h"

#include <cmath>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/mesh/convex_hull.h"
#include "geometry/object/load_object.h"
#include "geometry/rotation.h"
#include "geometry/score/contact_metrics.h"
#include "solver/hand/hand_landmarks.h"
#include "solver/trial/trial_clip.h"

namespace holdfast {
namespace {

TriangleMesh Block(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Eigen::Matrix3Xd corners(3, 8);
  for (int k = 0; k < 8; ++k) {
    for (int axis = 0; axis < 3; ++axis)
      corners(axis, k) = (k >> axis & 1) ? high[axis] : low[axis];
  }
  return ConvexHull(corners);
}

// Two plates on arms of 10 cm press a cube of 4 cm and 0.1 kg from both sides along x.
struct Plates {
  std::vector<MjcfLink> links{MjcfLink{}};
  std::vector<GripContact> contacts;
  TrialSolid solid;

  explicit Plates(double push_N) {
    for (const double side : {-1.0, 1.0}) {
      MjcfLink plate;
      plate.parent = 0;
      plate.joint = {0.03 * side, 0.0, -0.1};
      plate.axes = SpringAxes(Eigen::Vector3d::UnitY());
      plate.stiffness_Nm.setConstant(5.0);
      plate.limit_Nm << 10.0, 0.0, 0.0;
      plate.pieces = {Block({-0.01, -0.03, 0.0}, {0.01, 0.03, 0.13})};
      links.push_back(plate);
      contacts.push_back({static_cast<int>(links.size()) - 1,
                          {0.02 * side, 0.0, 0.0},
                          {-side, 0.0, 0.0},
                          {-side * push_N, 0.0, 0.0}});
    }
    solid.pieces = {Block({-0.02, -0.02, -0.02}, {0.02, 0.02, 0.02})};
    solid.mass = MassOfSolids(solid.pieces, 0.1 / 6.4e-5);
  }

  HoldTrial Try(double friction) const {
    TrialProtocol protocol;
    protocol.scene.friction = friction;
    return TryHold(links, contacts, solid, Eigen::Isometry3d::Identity(), protocol);
  }
};

TEST(MassOfSolids, OfABlockIsTheTextbooks) {
  const SolidMass mass = MassOfSolids({Block({0.1, 0.0, 0.0}, {0.3, 0.1, 0.4})}, 1000.0);
  EXPECT_NEAR(mass.mass_kg, 8.0, 1e-9);
  EXPECT_TRUE(mass.center.isApprox(Eigen::Vector3d(0.2, 0.05, 0.2), 1e-9));
  EXPECT_NEAR(mass.inertia(0, 0), 8.0 / 12.0 * (0.01 + 0.16), 1e-9);
  EXPECT_NEAR(mass.inertia(2, 2), 8.0 / 12.0 * (0.04 + 0.01), 1e-9);
  EXPECT_NEAR(mass.inertia(0, 1), 0.0, 1e-9);
}

// A hull of the whole palm, or of a bent phalanx, would fill its hollow by 7 mm and more.
TEST(LinksOfHand, StayNearTheSkin) {
  const HandModel hand(BodyModel::Default(), {}, Side::kRight);
  const HandAxes axes(hand);
  HandAngles angles = axes.Relaxed();
  for (int finger = 0; finger < kThumb; ++finger) angles(0, 3 * finger) += 40.0 * kDegree;
  HandEvaluation evaluation = AtWrist(hand);
  const HandState& state = evaluation.At(axes.PoseOf(angles).data(), false);
  const SignedDistance skin(CloseHoles({state.Vertices(), hand.Surface().Faces()}));
  const std::vector<MjcfLink> links = LinksOfHand(state, FingerStrength{});
  ASSERT_EQ(links.size(), 16u);
  double farthest = 0.0;
  for (std::size_t k = 0; k < links.size(); ++k) {
    const Eigen::Isometry3d world_from_link =
        k == 0 ? state.WorldFromWrist()
               : RigidTransform(state.JointRotation(static_cast<int>(k) - 1),
                                state.JointPositions().col(static_cast<int>(k) - 1));
    ASSERT_FALSE(links[k].pieces.empty()) << k;
    for (const TriangleMesh& piece : links[k].pieces) {
      for (const auto face : piece.faces.colwise()) {
        const Eigen::Vector3d middle = piece.vertices(Eigen::all, face).rowwise().mean();
        farthest = std::max(farthest, skin.Distance(world_from_link * middle));
      }
    }
  }
  EXPECT_LT(farthest, 0.005);
}

TEST(HoldTrial, SaysWhatToInstall) {
  if (HasPhysics()) GTEST_SKIP() << "built with MuJoCo";
  EXPECT_THROW(RequirePhysics(), Error);
}

// Two contacts hold m g while 2 mu N > m g: 0.098 for 5 N and 0.1 kg.
TEST(HoldTrial, PlatesHoldACubeAboveTheAnalyticFriction) {
  if (!HasPhysics()) GTEST_SKIP() << "built without MuJoCo (libmujoco-dev)";
  const Plates plates(5.0);
  const double limit = 0.1 * 9.81 / (2.0 * 5.0);
  const HoldTrial firm = plates.Try(1.3 * limit);
  EXPECT_EQ(firm.Held(), 6);
  EXPECT_LT(firm.WorstSlip_mm(), 3.0);
  const HoldTrial loose = plates.Try(0.7 * limit);
  EXPECT_EQ(loose.Held(), 2);  // along x it lies on a plate
  EXPECT_FALSE(loose.directions[4].holds);
  EXPECT_EQ(plates.Try(0.0).Held(), 0);
}

TEST(HoldTrial, NothingIsHeldThatNothingTouches) {
  if (!HasPhysics()) GTEST_SKIP() << "built without MuJoCo (libmujoco-dev)";
  Plates plates(5.0);
  plates.links.resize(1);
  plates.links[0].pieces = {Block({0.1, 0.0, 0.0}, {0.2, 0.1, 0.1})};
  plates.contacts.clear();
  const HoldTrial trial = plates.Try(0.8);
  EXPECT_EQ(trial.Held(), 0);
  // Free fall of a second.
  EXPECT_NEAR(trial.directions[1].slip_mm, 0.5e3 * 9.81, 20.0);
}

// As fitted, pieces overlap by what they reach out of skin and object: parted, not thrown.
TEST(HoldTrial, OverlapsPartWhileTheHandSettles) {
  if (!HasPhysics()) GTEST_SKIP() << "built without MuJoCo (libmujoco-dev)";
  constexpr double kOverlap_mm = 4.0;
  Plates beside(0.0);
  beside.links.resize(1);
  beside.links[0].pieces = {Block({0.02 - 1e-3 * kOverlap_mm, -0.03, -0.03}, {0.06, 0.03, 0.03})};
  beside.contacts.clear();
  const auto settle = [&](double drag_per_s) {
    TrialProtocol protocol;
    protocol.settle_drag_per_s = drag_per_s;
    return TryHold(beside.links, beside.contacts, beside.solid, Eigen::Isometry3d::Identity(),
                   protocol)
        .settling.most_slip_mm;
  };
  const double parted = settle(TrialProtocol{}.settle_drag_per_s);
  EXPECT_GT(parted, 0.5 * kOverlap_mm);
  EXPECT_LT(parted, 2.0 * kOverlap_mm);
  EXPECT_GT(settle(0.0), 5.0 * kOverlap_mm);
}

TEST(HoldTrial, IsTheSameOnAnyThreads) {
  if (!HasPhysics()) GTEST_SKIP() << "built without MuJoCo (libmujoco-dev)";
  const Plates plates(2.0);
  TrialProtocol protocol;
  const HoldTrial one =
      TryHold(plates.links, plates.contacts, plates.solid, Eigen::Isometry3d::Identity(), protocol);
  protocol.threads = 3;
  const HoldTrial three =
      TryHold(plates.links, plates.contacts, plates.solid, Eigen::Isometry3d::Identity(), protocol);
  for (int k = 0; k < kTrialDirections; ++k) {
    EXPECT_EQ(one.directions[k].slip_mm, three.directions[k].slip_mm);
    EXPECT_EQ(one.directions[k].slip_deg, three.directions[k].slip_deg);
  }
}

// A hand around a block holds it, an open hand beside it does not.
TEST(TryGrasps, JudgesEachOfMany) {
  if (!HasPhysics()) GTEST_SKIP() << "built without MuJoCo (libmujoco-dev)";
  const TriangleMesh block = Block({-0.03, -0.02, 0.0}, {0.03, 0.02, 0.09});
  const HandModel hand(BodyModel::Default(), {}, Side::kRight);
  GraspSetOptions options;
  options.count = 1;
  options.search.turns = 6;
  const SignedDistance surface(block);
  GraspSet set = FindGrasps(hand, block, DistanceGrid(surface, {.cell_m = 0.003}), options);
  ASSERT_EQ(set.grasps.size(), 1u);
  set.grasps.push_back(set.grasps[0]);
  set.grasps[1].grasp.fingers.setZero();
  set.grasps[1].grasp.wrist_from_object.translation() *= 2.0;
  int calls = 0;
  const std::vector<HoldTrial> trials = TryGrasps(hand, block, set.grasps, {}, [&](double share) {
    EXPECT_EQ(share, 0.5 * ++calls);
    return true;
  });
  ASSERT_EQ(trials.size(), 2u);
  EXPECT_EQ(trials[0].Held(), 6);
  EXPECT_EQ(trials[1].Held(), 0);
  calls = 0;
  TryGrasps(hand, block, set.grasps, {}, [&](double) { return ++calls > 1; });
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace holdfast
