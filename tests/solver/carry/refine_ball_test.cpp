// SPDX-License-Identifier: MIT
// A ball that goes with a hand at a distance or within it, its rotation not known.
#include "solver/carry/follow.h"

#include <array>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/score/contact_score.h"
#include "solver/carry/refine.h"

namespace holdfast {
namespace {

constexpr double kRadius = 0.12;
constexpr int kBallFrames = 40;

const PreparedObject& Ball() {
  static const PreparedObject ball = [] {
    TriangleMesh mesh = LoadObject("sphere").mesh;
    mesh.vertices.colwise() -= mesh.vertices.rowwise().mean().eval();
    for (auto vertex : mesh.vertices.colwise()) vertex *= kRadius / vertex.norm();
    return PrepareObject(ObjectOfMesh(mesh, "ball", "ball"));
  }();
  return ball;
}

// The demo's first frames, with a ball below the right palm whose surface is `gap` meters off the
// palm's skin (negative: in it), but for the last ten frames, in which it flies away.
LoadedClip WithBall(double gap) {
  LoadedClip loaded = LoadClip("demo_drink");
  Clip& clip = loaded.clip;
  clip = Slice(clip, 0, kBallFrames);
  const HandModel hand(loaded.body.model, loaded.body.betas, Side::kRight);
  const HandAxes axes(hand);
  HandState state(hand);
  ObjectTrack& track = clip.object.emplace();
  track.name = "ball";
  track.trans.resize(3, kBallFrames);
  track.orient.setZero(3, kBallFrames);
  for (int t = 0; t < kBallFrames; ++t) {
    state.SetBody(clip.pose[t], clip.trans.col(t));
    state.Evaluate(FingersOf(clip.pose[t], Side::kRight), false);
    const Eigen::Vector3d palm = state.WristRotation() * axes.PalmNormal();
    const Eigen::Vector3d middle = state.JointPositions().col(3 * kMiddle);
    const double skin = (palm.transpose() * (state.Vertices().colwise() - middle)).maxCoeff();
    track.trans.col(t) = middle + palm * (skin + gap + kRadius);
    if (t >= kBallFrames - 10) track.trans.col(t) += palm * 0.08 * (t - kBallFrames + 11);
  }
  return loaded;
}

TEST(UnturnedBall, IsASphereThatMovesAndNeverTurns) {
  LoadedClip loaded = WithBall(0.01);
  const TriangleMesh& mesh = Ball().object.mesh;
  EXPECT_TRUE(IsUnturnedBall(loaded.clip, mesh));
  EXPECT_FALSE(IsUnturnedBall(loaded.clip, LoadObject("cube").mesh));
  Clip turned = loaded.clip;
  turned.object->orient(1, 7) = 0.1;
  EXPECT_FALSE(IsUnturnedBall(turned, mesh));
  Clip still = loaded.clip;
  still.object->trans.colwise() = Eigen::Vector3d(0.0, 0.0, 0.5);
  EXPECT_FALSE(IsUnturnedBall(still, mesh));
  still.object.reset();
  EXPECT_FALSE(IsUnturnedBall(still, mesh));
}

TEST(Follow, IsToBeNearAndToMoveTogether) {
  const LoadedClip loaded = WithBall(0.02);
  const HandModel right(loaded.body.model, loaded.body.betas, Side::kRight);
  const HandModel left(loaded.body.model, loaded.body.betas, Side::kLeft);
  const std::array<const HandModel*, 2> hands = {&right, &left};
  const std::vector<std::uint8_t> follows = FindFollows(loaded.clip, hands, Ball());
  for (int t = 0; t < kBallFrames - 13; ++t) EXPECT_EQ(follows[t], kHoldsRight) << t;
  for (int t = kBallFrames - 9; t < kBallFrames; ++t) EXPECT_EQ(follows[t], 0) << t;  // flies
  EXPECT_EQ(follows, FindFollows(loaded.clip, hands, Ball(), 3));
  // Farther off it is near no more.
  const Clip far = WithBall(0.06).clip;
  for (const std::uint8_t bits : FindFollows(far, hands, Ball())) EXPECT_EQ(bits, 0);
  // On the ground it lies.
  Clip lying = loaded.clip;
  for (int t = 0; t < kBallFrames; ++t) {
    lying.trans.col(t) -= loaded.clip.object->trans.col(0) - Eigen::Vector3d(0, 0, kRadius);
    lying.object->trans.col(t) = Eigen::Vector3d(0, 0, kRadius);
    lying.pose[t] = lying.pose[0];
    lying.trans.col(t) = lying.trans.col(0);
  }
  for (const std::uint8_t bits : FindFollows(lying, hands, Ball())) EXPECT_EQ(bits, 0);
  Clip without = loaded.clip;
  without.object.reset();
  EXPECT_THROW(FindFollows(without, hands, Ball()), Error);
  EXPECT_THROW(RefineBall(without, hands, Ball(), follows, RefinementDefaults()), Error);
}

// Beside the ball by 2 cm, and in it by 3 cm.
class RefineBallTest : public ::testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Gaps, RefineBallTest, ::testing::Values(0.02, -0.03));

TEST_P(RefineBallTest, HandsComeToTheBallWithoutGoingIntoIt) {
  const LoadedClip loaded = WithBall(GetParam());
  const RefineReport report = RefineCarried(loaded.clip, loaded.body, Ball());
  ASSERT_EQ(report.status, RefineStatus::kRefined);
  EXPECT_TRUE(report.ball);
  ASSERT_GT(report.after.hand_frames, kBallFrames - 15);
  if (GetParam() > 0.0) {
    EXPECT_EQ(report.before.hand_frames_in_contact, 0);
  } else {
    EXPECT_GT(report.before.contact.deep_frames, 20);
  }
  EXPECT_EQ(report.after.contact.deep_frames, 0);
  EXPECT_GE(report.after.hand_frames_in_contact, 0.95 * report.after.hand_frames);
  EXPECT_EQ(report.after.tips.inside, 0);
  EXPECT_GT(report.after.tips.touch, report.before.tips.touch + report.after.hand_frames);
  const FingertipCounts& tips = report.after.tips;
  EXPECT_EQ(tips.touch + tips.beside + tips.inside, 5 * report.after.hand_frames);
  EXPECT_EQ(report.after.finger_jump_frames, 0);
  EXPECT_EQ(report.distance.rms_mm, 0.0);  // it is where it was tracked
  ASSERT_EQ(report.result.touches.size(), 1u);
  EXPECT_EQ(report.result.touches[0].side, Side::kRight);

  RefineOptions threads;
  threads.threads = 3;
  const RefineReport again = RefineCarried(loaded.clip, loaded.body, Ball(), threads);
  for (int t = 0; t < kBallFrames; ++t) {
    EXPECT_EQ(again.result.clip.pose[t], report.result.clip.pose[t]) << t;
  }
}

TEST(RefineBall, SaysWhenTheBallIsNeverNearAHand) {
  LoadedClip loaded = WithBall(0.02);
  loaded.clip.object->trans.row(0).array() += 3.0;
  EXPECT_THROW(RefineCarried(loaded.clip, loaded.body, Ball()), Error);
}

TEST(RefineBall, ABallInTheGroundIsLifted) {
  LoadedClip loaded = WithBall(0.01);
  const double deep = loaded.clip.object->trans(2, 20) - kRadius + 0.03;  // 3 cm in it, in frame 20
  loaded.clip.trans.row(2).array() -= deep;
  loaded.clip.object->trans.row(2).array() -= deep;
  const RefineReport report = RefineCarried(loaded.clip, loaded.body, Ball());
  ASSERT_EQ(report.status, RefineStatus::kRefined);
  EXPECT_NEAR(report.distance.mm[20], 30.0, 1.0);
  EXPECT_GT(report.result.clip.object->trans.row(2).minCoeff(), kRadius - 0.001);
}

}  // namespace
}  // namespace holdfast
