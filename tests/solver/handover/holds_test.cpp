// SPDX-License-Identifier: MIT
#include "solver/handover/holds.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "generator/scripted/handover_motion.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "solver/handover/handover_search.h"

namespace holdfast {
namespace {

const HandModel& Right() {
  static const HandModel hand(BodyModel::Default(), {}, Side::kRight);
  return hand;
}
const HandModel& Left() {
  static const HandModel hand(BodyModel::Default(), {}, Side::kLeft);
  return hand;
}

struct Sphere {
  TriangleMesh mesh = ReadMesh(HOLDFAST_MESHES_DIR "/objects/sphere.ply");
  DistanceGrid grid{SignedDistance(mesh), {.cell_m = 0.004}};
};
const Sphere& Ball() {
  static const Sphere sphere;
  return sphere;
}

HandoverMotion Handover(std::uint64_t seed, int switches = 1) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  HandoverOptions options;
  options.seed = seed;
  options.switches = switches;
  options.first_hand = Side::kRight;
  return MakeHandoverMotion(body, PalmGrasps(body, Ball().mesh.vertices, seed), options);
}

HoldLabels Find(const Clip& clip, int threads = 1) {
  return FindHolds(clip, Right(), Left(), Ball().grid, threads);
}

// Everything up to shortly before the first switch: the right hand carries.
Clip RightCarries() {
  const HandoverMotion motion = Handover(9);
  const auto both = std::find(motion.clip.holding_hand.begin(), motion.clip.holding_hand.end(), 3);
  return Slice(motion.clip, 0, static_cast<int>(both - motion.clip.holding_hand.begin()) - 8);
}

// Seen in a mirror at x = 0.
Clip Mirrored(Clip clip) {
  const double pelvis = BodySurface(BodyModel::Default()).RestJoints()(0, 0);
  for (JointPose& pose : clip.pose) pose = MirrorPose(pose);
  clip.trans.row(0) = -clip.trans.row(0).array() - 2.0 * pelvis;
  clip.object->trans.row(0) *= -1.0;
  clip.object->orient.bottomRows<2>() *= -1.0;
  return clip;
}

TEST(FindHolds, ARigidCarryIsTheCarryingHandThroughout) {
  const Clip clip = RightCarries();
  ASSERT_GT(clip.NumFrames(), 5);
  const HoldLabels holding = Find(clip);
  EXPECT_EQ(holding.hands, std::vector<std::uint8_t>(clip.pose.size(), kHoldsRight));
  EXPECT_TRUE(holding.switches.empty());
  for (const double confidence : holding.confidence) EXPECT_GT(confidence, 0.9);
}

TEST(FindHolds, NobodyHoldsWhatRestsApart) {
  Clip clip = Handover(3).clip;
  clip.object->trans.colwise() = Eigen::Vector3d(0.0, -1.2, 0.8);
  clip.object->orient.setZero();
  EXPECT_EQ(Find(clip).hands, std::vector<std::uint8_t>(clip.pose.size(), 0));
  AddNoise(clip, {0.005, 0.05, 0.0175}, 1);
  EXPECT_EQ(Find(clip).hands, std::vector<std::uint8_t>(clip.pose.size(), 0));
}

TEST(FindHolds, PickedUpFromRestIsNobodyThenTheHand) {
  // The hand comes, takes it, and carries it: the carry of a handover's second part, before which
  // the object waits where the receiving hand meets it.
  HandoverMotion motion = Handover(12);
  Clip& clip = motion.clip;
  const int frame = motion.switch_frames.front();
  for (int t = 0; t < frame; ++t) {
    clip.object->trans.col(t) = clip.object->trans.col(frame);
    clip.object->orient.col(t) = clip.object->orient.col(frame);
  }
  // The giving hand stays away.
  for (JointPose& pose : clip.pose) {
    for (const int joint : {17, 19, 21}) pose.col(joint).setZero();
  }
  const HoldLabels holding = Find(clip);
  EXPECT_EQ(holding.hands.front(), 0);
  EXPECT_EQ(holding.hands.back(), kHoldsLeft);
  EXPECT_TRUE(holding.switches.empty());
  const auto taken = std::find(holding.hands.begin(), holding.hands.end(), kHoldsLeft);
  EXPECT_NEAR(static_cast<double>(taken - holding.hands.begin()), frame, 12.0);
  EXPECT_TRUE(std::all_of(taken, holding.hands.end(), [](int h) { return h == kHoldsLeft; }));
}

TEST(FindHolds, AMirroredClipHasTheMirroredAnswer) {
  const HandoverMotion motion = Handover(7, 2);
  const HoldLabels holding = Find(motion.clip), mirrored = Find(Mirrored(motion.clip));
  ASSERT_EQ(holding.switches.size(), 2u);
  ASSERT_EQ(mirrored.switches.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(mirrored.switches[k].frame, holding.switches[k].frame, 1.0);
    EXPECT_EQ(mirrored.switches[k].from, holding.switches[k].to);
  }
}

TEST(FindHolds, DoesNotCareWhereTheWorldIs) {
  const HandoverMotion motion = Handover(4);
  Clip moved = motion.clip;
  const Eigen::Vector3d shift(3.0, -2.0, 0.5);
  moved.trans.colwise() += shift;
  moved.object->trans.colwise() += shift;
  EXPECT_EQ(Find(moved).hands, Find(motion.clip).hands);
}

TEST(FindHolds, IsTheSameOnAnyNumberOfThreads) {
  const Clip clip = Handover(5).clip;
  const HoldLabels a = Find(clip), b = Find(clip, 2);
  EXPECT_EQ(a.hands, b.hands);
  EXPECT_EQ(a.confidence, b.confidence);
}

TEST(FindHolds, NeedsAnObjectAndBothHands) {
  Clip clip = Handover(5).clip;
  EXPECT_THROW(FindHolds(clip, Left(), Right(), Ball().grid), Error);
  clip.object.reset();
  EXPECT_THROW(Find(clip), Error);
}

TEST(SwitchesOf, ReadsThemFromTheBits) {
  const std::vector<HandSwitch> switches = SwitchesOf({0, 1, 1, 3, 3, 3, 2, 2, 3, 2, 0, 1});
  ASSERT_EQ(switches.size(), 2u);
  EXPECT_EQ(switches[0].frame, 4);
  EXPECT_EQ(switches[0].both_begin, 3);
  EXPECT_EQ(switches[0].both_end, 6);
  EXPECT_EQ(switches[0].from, Side::kRight);
  EXPECT_EQ(switches[1].frame, 11);
  EXPECT_EQ(switches[1].both_begin, switches[1].both_end);
  EXPECT_TRUE(SwitchesOf({1, 1, 3, 1, 0, 1}).empty());
  EXPECT_TRUE(SwitchesOf({}).empty());
}

TEST(HoldersText, CountsFramesByWhoHolds) {
  const auto text = [](const std::vector<std::uint8_t>& hands) {
    return HoldersText(CountHeld(hands));
  };
  EXPECT_EQ(text({1, 1, 1}), "the right hand through 3 frames");
  EXPECT_EQ(text({3, 3}), "both hands through 2 frames");
  EXPECT_EQ(text({1, 1, 3, 2, 2, 2}),
            "the right hand in 2, the left hand in 3 and both hands in 1 of 6 frames");
  EXPECT_EQ(text({0, 2, 2}), "the left hand in 2 of 3 frames");
  EXPECT_EQ(text({1, 0, 2}), "the right hand in 1 and the left hand in 1 of 3 frames");
  EXPECT_EQ(text({0, 0}), "no hand in 2 frames");
}

TEST(ViterbiPath, IsTheCheapestOfAllPaths) {
  const Eigen::Matrix<double, 2, 5> costs{{0.0, 2.0, 0.1, 3.0, 1.0}, {1.0, 0.5, 0.4, 0.2, 1.1}};
  const Eigen::Matrix2d change{{0.0, 0.7}, {0.9, 0.0}};
  const StatePath path = ViterbiPath(costs, change);
  double best = 1e9, total = 0.0;
  std::vector<int> best_states;
  Eigen::Matrix<double, 2, 5> mass = Eigen::Matrix<double, 2, 5>::Zero();
  for (int code = 0; code < 32; ++code) {
    std::vector<int> states;
    double cost = 0.0;
    for (int t = 0; t < 5; ++t) {
      states.push_back(code >> t & 1);
      cost += costs(states[t], t) + (t > 0 ? change(states[t - 1], states[t]) : 0.0);
    }
    if (cost < best) {
      best = cost;
      best_states = states;
    }
    total += std::exp(-cost);
    for (int t = 0; t < 5; ++t) mass(states[t], t) += std::exp(-cost);
  }
  EXPECT_EQ(path.states, best_states);
  EXPECT_NEAR(path.cost, best, 1e-12);
  EXPECT_LT((path.posterior - mass / total).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(FindHandovers, TakesWhatItIsGiven) {
  Clip clip = Handover(5).clip;
  HandoverSearchOptions options;
  options.switch_frames = {20, 60};
  options.first_hand = Side::kLeft;
  const HoldLabels holding = FindHandovers(clip, Right(), Left(), 0.07, options);
  ASSERT_EQ(holding.switches.size(), 2u);
  EXPECT_EQ(holding.switches[0].frame, 20);
  EXPECT_EQ(holding.switches[1].to, Side::kLeft);
  EXPECT_EQ(holding.hands.front(), kHoldsLeft);
  EXPECT_EQ(holding.hands[20], 3);
  EXPECT_EQ(holding.hands[40], kHoldsRight);
  options.switch_frames = {60, 20};
  EXPECT_THROW(FindHandovers(clip, Right(), Left(), 0.07, options), Error);
  options.switch_frames = {clip.NumFrames()};
  EXPECT_THROW(FindHandovers(clip, Right(), Left(), 0.07, options), Error);
}

TEST(FindHandovers, SaysSoWhenTheHandsNeverMeet) {
  Clip clip = Handover(5).clip;
  for (JointPose& pose : clip.pose) pose.middleCols<6>(16).setZero();  // arms stretched sideways
  EXPECT_THROW(FindHandovers(clip, Right(), Left(), 0.07), Error);
}

}  // namespace
}  // namespace holdfast
