// SPDX-License-Identifier: MIT
#include "solver/synthesis/synthesis.h"

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/rotation.h"
#include "tests/support/hand_scene.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// One frame of somebody with an object in the right hand.
struct Holder {
  Holder() {
    object.vertices = scene.object;
    clip.pose = {scene.pose};
    clip.trans = scene.trans;
    clip.object.emplace();
    clip.object->trans = scene.object_pose.translation;
    clip.object->orient = LogSO3(scene.object_pose.orientation.toRotationMatrix());
    clip.holding_hand = {kHoldsRight};
    measures = MeasureBody(*scene.model, {});
  }
  SynthesisScene Scene(const Clip& start) const {
    return {start, measures.rest_joints, hands, object, {3, 1}, 0.2, 9, false};
  }
  std::vector<Synthesized> Make(const Clip& start, int samples, std::uint64_t first, int threads,
                                double sigma = 1.0) const {
    return Synthesize(network, imos::ActionTable(weights), Scene(start), FitOptions().OnlyPaper(),
                      samples, 5, first, sigma, threads);
  }

  testing::HandScene scene;
  HandModel left{scene.model, {}, Side::kLeft};
  const HandModel* const hands[2] = {&scene.hand, &left};
  FitObject object;
  Clip clip;
  BodyMeasures measures;
  imos::NetworkWeights weights = imos::RandomNetwork(imos::CompactConfig(), 3);
  imos::Network<float> network{weights};
};

TEST(SynthesisHistory, StandsStillBeforeAShortStart) {
  const Holder holder;
  const Clip history = HistoryOf(holder.clip, 0.2);
  ASSERT_EQ(history.NumFrames(), imos::kHistory);
  EXPECT_DOUBLE_EQ(history.frame_rate, 5.0);
  for (int k = 0; k < imos::kHistory; ++k) {
    EXPECT_EQ(history.pose[k], holder.clip.pose[0]);
    EXPECT_EQ(history.object->trans.col(k), holder.clip.object->trans.col(0));
  }
}

TEST(SynthesisHistory, IsTakenFromTheEndOfALongStart) {
  const Holder holder;
  Clip start = holder.clip;
  start.frame_rate = 30.0;
  const int count = 31;
  start.pose.assign(count, holder.clip.pose[0]);
  start.holding_hand.assign(count, kHoldsRight);
  start.trans = Eigen::Matrix3Xd::Zero(3, count);
  for (int t = 0; t < count; ++t) start.trans(0, t) = t;
  start.object->trans = start.trans;
  start.object->orient = Eigen::Matrix3Xd::Zero(3, count);
  const Clip history = HistoryOf(start, 0.15);  // 4.5 frames apart
  EXPECT_DOUBLE_EQ(history.trans(0, 3), 30.0);
  EXPECT_NEAR(history.trans(0, 2), 25.5, 1e-9);
  EXPECT_NEAR(history.trans(0, 1), 21.0, 1e-9);
  EXPECT_NEAR(history.object->trans(0, 0), 16.5, 1e-9);
}

// Rounding puts some of these a hair off their frames.
TEST(SynthesisHistory, KeyFramesOfItsOwnRateAreTakenAsTheyAre) {
  const Holder holder;
  Clip start = holder.clip;
  start.pose.assign(imos::kHistory, holder.clip.pose[0]);
  start.holding_hand.assign(imos::kHistory, kHoldsRight);
  start.trans = Eigen::Matrix3Xd::Zero(3, imos::kHistory);
  for (int t = 0; t < imos::kHistory; ++t) start.trans(0, t) = t;
  start.object->trans = start.trans;
  start.object->orient = Eigen::Matrix3Xd::Zero(3, imos::kHistory);
  for (int frames = 40; frames < 400; ++frames) {
    const double seconds = (frames - 1) / 30.0 / (imos::kNumKeyFrames - 1);
    start.frame_rate = 1.0 / seconds;
    const Clip history = HistoryOf(start, seconds);
    EXPECT_LT((history.trans - start.trans).cwiseAbs().maxCoeff(), 1e-6) << frames;
  }
}

TEST(SynthesisHistory, SaysWhatIsMissing) {
  const Holder holder;
  Clip start = holder.clip;
  start.holding_hand = {0};
  EXPECT_THROW(HistoryOf(start, 0.2), Error);
  start = holder.clip;
  start.object.reset();
  EXPECT_THROW(HistoryOf(start, 0.2), Error);
  EXPECT_THROW(HistoryOf(Clip(), 0.2), Error);
}

TEST(Synthesis, TheObjectStaysInTheHand) {
  const Holder holder;
  const Synthesized made = holder.Make(holder.clip, 1, 0, 1)[0];
  ASSERT_EQ(made.clip.NumFrames(), 9);
  ASSERT_EQ(made.reports.size(), 5u);
  HandState hand(holder.scene.hand);
  const auto in_wrist = [&](int t) -> Vector3d {
    hand.SetBody(made.clip.pose[t], made.clip.trans.col(t));
    return hand.WristRotation().transpose() *
           (made.clip.object->trans.col(t) - hand.WristPosition());
  };
  double farthest = 0.0;
  for (int t = 4; t < 9; ++t) {
    EXPECT_LT((in_wrist(t) - in_wrist(0)).norm(), 2e-3) << t;
    farthest = std::max(farthest,
                        (made.clip.object->trans.col(t) - made.clip.object->trans.col(0)).norm());
    EXPECT_EQ(made.clip.holding_hand[t], kHoldsRight);
  }
  EXPECT_GT(farthest, 1e-4) << "the person moves";
}

TEST(Synthesis, ASampleDependsNeitherOnThreadsNorOnTheOthers) {
  const Holder holder;
  const auto three = holder.Make(holder.clip, 3, 0, 2), again = holder.Make(holder.clip, 3, 0, 1),
             second = holder.Make(holder.clip, 1, 1, 1);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(three[i].clip.pose, again[i].clip.pose);
  EXPECT_EQ(three[1].clip.pose, second[0].clip.pose);
  EXPECT_EQ(three[1].clip.object->trans, second[0].clip.object->trans);
  EXPECT_NE(three[0].clip.pose, three[1].clip.pose);
}

TEST(Synthesis, WhereAndWhichWayThePersonStandsDoesNotMatter) {
  const Holder holder;
  const Matrix3d turn = ExpSO3(Vector3d(0.0, 0.0, 1.1));
  const Vector3d pelvis = holder.measures.rest_joints.col(0), shift(2.0, -1.0, 0.0);
  const auto moved = [&](const Vector3d& x) -> Vector3d { return turn * x + shift; };
  Clip other = holder.clip;
  other.trans.col(0) = moved(holder.clip.trans.col(0) + pelvis) - pelvis;
  other.pose[0].col(0) = LogSO3(turn * ExpSO3(holder.clip.pose[0].col(0)));
  other.object->trans.col(0) = moved(holder.clip.object->trans.col(0));
  other.object->orient.col(0) = LogSO3(turn * ExpSO3(holder.clip.object->orient.col(0)));
  const Synthesized here = holder.Make(holder.clip, 1, 0, 1)[0],
                    there = holder.Make(other, 1, 0, 1)[0];
  for (int t = 0; t < here.clip.NumFrames(); ++t) {
    EXPECT_LT((moved(here.clip.object->trans.col(t)) - there.clip.object->trans.col(t)).norm(),
              1e-4);
    EXPECT_LT((moved(here.clip.trans.col(t) + pelvis) - pelvis - there.clip.trans.col(t)).norm(),
              1e-5);
  }
}

TEST(SynthesisMotion, StandingFeetStay) {
  const Holder holder;
  Clip keys;
  keys.frame_rate = 5.0;
  keys.trans = Eigen::Matrix3Xd::Zero(3, 9);
  JointPose standing = JointPose::Zero();
  standing.col(0) = Vector3d(M_PI / 2, 0, 0);
  for (int t = 0; t < 9; ++t) {
    keys.pose.push_back(standing);
    keys.pose.back()(0, 16) = 0.1 * t;
    // The whole body slides about by centimeters, as a network's does.
    keys.trans.col(t) = Vector3d(0.01 * (t % 3), -0.008 * (t % 2), -holder.measures.sole_y);
  }
  const Clip motion = MotionOfKeyFrames(keys, holder.measures, 30.0, 1);
  ASSERT_EQ(motion.NumFrames(), 49);
  Eigen::Matrix3Xd ankles(3, 49);
  double slid = 0.0, swung = 0.0;
  for (int t = 0; t < 49; ++t) {
    BodyState state;
    ForwardJoints(holder.measures.rest_joints, motion.pose[t], motion.trans.col(t), state);
    ankles.col(t) = state.joints.col(7);
    if (t > 0) slid = std::max(slid, (ankles.col(t) - ankles.col(t - 1)).head<2>().norm());
    swung = std::max(swung, motion.pose[t](0, 16));
  }
  EXPECT_LT(slid, 1e-3);
  EXPECT_NEAR(swung, 0.8, 0.06) << "arms are the key frames', and sway a little";
}

}  // namespace
}  // namespace holdfast
