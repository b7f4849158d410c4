// SPDX-License-Identifier: MIT
#include "solver/fit/fit.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "tests/support/hand_scene.h"

namespace holdfast {
namespace {

using testing::HandScene;

// A clip whose body turns and walks as a whole, so that hand and object move rigidly together and
// the object's true pose is known in every frame.
struct RigidClip {
  RigidClip(const HandScene& scene, int frames) {
    const BodySurface joints(scene.model, {}, std::vector<int>{});
    const Eigen::Vector3d pelvis = joints.RestJoints().col(0);
    clip.frame_rate = 10.0;
    clip.trans.resize(3, frames);
    clip.object.emplace();
    clip.object->trans.setZero(3, frames);
    clip.object->orient.setZero(3, frames);
    for (int t = 0; t < frames; ++t) {
      const Eigen::Matrix3d turn = ExpSO3(Eigen::Vector3d(0.03 * t, -0.1 * t, 0.25 * t));
      const Eigen::Vector3d shift(0.1 * t, 0.02 * t * t, 0.05 * std::sin(t));
      JointPose pose = scene.pose;
      pose.col(0) = LogSO3(turn * ExpSO3(scene.pose.col(0)));
      clip.pose.push_back(pose);
      // x' = turn x + shift for every vertex, with the root turning about the pelvis.
      clip.trans.col(t) = turn * (pelvis + scene.trans) + shift - pelvis;
      truth.push_back({Eigen::Quaterniond(turn) * scene.object_pose.orientation,
                       turn * scene.object_pose.translation + shift});
    }
    clip.object->trans.col(0) = truth[0].translation;
    clip.object->orient.col(0) = LogSO3(truth[0].orientation.toRotationMatrix());
  }
  Clip clip;
  std::vector<ObjectPose> truth;
};

// One hand holding through the whole clip, with the paper's terms only.
FitResult FitClip(const Clip& clip, const HandModel& hand, const Eigen::Matrix3Xd& object_vertices,
                  const FitOptions& options = {},
                  const std::function<bool(int, int)>& progress = {}) {
  FitObject object;
  object.vertices = object_vertices;
  const HandModel* const hands[] = {&hand};
  const std::vector<std::uint8_t> holding(
      clip.pose.size(), hand.HandSide() == Side::kRight ? kHoldsRight : kHoldsLeft);
  return holdfast::FitClip(clip, hands, object, holding, options.OnlyPaper(), {}, progress);
}

TEST(FitClip, RecoversAnObjectThatMovesRigidlyWithTheHand) {
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const HandScene scene(side);
    const RigidClip rigid(scene, 20);
    for (const PairPrecision precision : {PairPrecision::kSingle, PairPrecision::kDouble}) {
      FitOptions options;
      options.precision = precision;
      const FitResult result = FitClip(rigid.clip, scene.hand, scene.object, options);
      ASSERT_EQ(result.frames.size(), 20u);
      for (int t = 0; t < 20; ++t) {
        const ObjectTrack& track = *result.clip.object;
        EXPECT_LT((track.trans.col(t) - rigid.truth[t].translation).norm(), 1e-4) << t;
        EXPECT_LT(AngleBetween(ExpSO3(track.orient.col(t)),
                               rigid.truth[t].orientation.toRotationMatrix()),
                  0.05 * std::numbers::pi / 180.0)
            << t;
        EXPECT_EQ(result.clip.holding_hand[t], side == Side::kRight ? kHoldsRight : kHoldsLeft);
        if (t > 0) {
          EXPECT_EQ(result.frames[t].stop, StopReason::kConverged) << t;
          // Unwrapped: no jump by a turn. (Near a whole turn axis-angles move faster than
          // rotations.)
          EXPECT_LT((track.orient.col(t) - track.orient.col(t - 1)).norm(), 1.6) << t;
        }
      }
    }
  }
}

TEST(FitClip, SolvesWithoutTheRigidStartsHelp) {
  // A wrist that bends deforms the hand: no rigid pose keeps all distances, and the optimum is not
  // where the solver starts. Both precisions must find the same one.
  const HandScene scene;
  Clip clip;
  clip.frame_rate = 10.0;
  clip.trans = scene.trans.replicate(1, 8);
  clip.object.emplace();
  clip.object->trans = scene.object_pose.translation.replicate(1, 8);
  clip.object->orient = LogSO3(scene.object_pose.orientation.toRotationMatrix()).replicate(1, 8);
  for (int t = 0; t < 8; ++t) {
    JointPose pose = scene.pose;
    pose.col(21) = Eigen::Vector3d(0.05 * t, -0.08 * t, 0.1 * t);
    clip.pose.push_back(pose);
  }
  FitOptions options;
  options.precision = PairPrecision::kDouble;
  const FitResult exact = FitClip(clip, scene.hand, scene.object, options);
  options.precision = PairPrecision::kSingle;
  const FitResult fast = FitClip(clip, scene.hand, scene.object, options);
  HandState state(scene.hand);
  const auto hand_in_object = [&](const Clip& fitted, int t) {
    state.SetBody(fitted.pose[t], fitted.trans.col(t));
    state.Evaluate(FingersOf(fitted.pose[t], Side::kRight), false);
    return InObjectFrame(state.Vertices(), Eigen::Quaterniond(ExpSO3(fitted.object->orient.col(t))),
                         fitted.object->trans.col(t));
  };
  const HandObjectDistance distance(
      scene.object, HandObjectDistance::Distances(hand_in_object(clip, 0), scene.object), 1.0,
      PairPrecision::kDouble);
  const auto energy_distance = [&](const Clip& fitted, int t) {
    std::vector<VertexQuadratic> ignored(static_cast<std::size_t>(scene.hand.NumVertices()));
    return distance.Add(hand_in_object(fitted, t), ignored);
  };
  for (int t = 1; t < 8; ++t) {
    EXPECT_EQ(exact.frames[t].stop, StopReason::kConverged) << t;
    const double energy = energy_distance(exact.clip, t);
    EXPECT_GT(energy, 1e-4) << t;
    EXPECT_NEAR(exact.frames[t].energies[EnergyTerm::kDistance], energy, 1e-9 * energy) << t;
    EXPECT_NEAR(energy_distance(fast.clip, t), energy, 5e-6 * energy) << t;
    EXPECT_NEAR(fast.frames[t].energies[EnergyTerm::kDistance], energy, 1e-5 * energy)
        << t;  // as it is summed
    EXPECT_LT((fast.clip.object->trans.col(t) - exact.clip.object->trans.col(t)).norm(), 1e-5);
  }
}

TEST(FitClip, AClipOfOneFrameIsItsGrasp) {
  const HandScene scene;
  const RigidClip rigid(scene, 1);
  const FitResult result = FitClip(rigid.clip, scene.hand, scene.object);
  ASSERT_EQ(result.frames.size(), 1u);
  EXPECT_EQ(result.frames[0].stop, StopReason::kGiven);
  EXPECT_NEAR(result.frames[0].energies[EnergyTerm::kDistance], 0.0,
              1e-10);  // what single precision leaves
  EXPECT_EQ(result.clip.object->trans, rigid.clip.object->trans);
}

TEST(FitClip, NamesWhatIsMissing) {
  const HandScene scene;
  RigidClip rigid(scene, 2);
  EXPECT_THROW(FitClip(rigid.clip, scene.hand, Eigen::Matrix3Xd(3, 0)), Error);
  rigid.clip.object.reset();
  EXPECT_THROW(FitClip(rigid.clip, scene.hand, scene.object), Error);
}

TEST(FitClip, StopsWhenAsked) {
  const HandScene scene;
  const RigidClip rigid(scene, 10);
  const FitResult result =
      FitClip(rigid.clip, scene.hand, scene.object, {}, [](int done, int) { return done < 4; });
  EXPECT_EQ(result.frames.size(), 4u);
  EXPECT_EQ(result.clip.NumFrames(), 4);
}

}  // namespace
}  // namespace holdfast
