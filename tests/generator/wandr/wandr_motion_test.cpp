// SPDX-License-Identifier: MIT
#include <cmath>

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/pose.h"
#include "generator/wandr/statistics.h"
#include "geometry/error.h"
#include "tests/support/wandr_scene.h"

namespace holdfast::wandr {
namespace {

using testing::DefaultBody;
using testing::DefaultBones;

Clip ReachClip() {
  std::vector<ReachKey> keys(3);
  for (int i = 0; i < 3; ++i) {
    keys[i].time_s = 0.5 * i;
    keys[i].wrist = {-0.25 + 0.1 * i, -0.3 - 0.05 * i, 0.9 + 0.2 * i};
  }
  return MakeReachMotion(DefaultBody(), keys);
}

// A person who walks and turns: poses of no use, on a path of 4 m.
StateMatrix<double> WalkingStates(int num_frames) {
  nn::RandomStream random(31);
  const Pose<double> standing = StandingPose(DefaultBody());
  StateMatrix<double> states(kStateSize, num_frames);
  for (int t = 0; t < num_frames; ++t) {
    Pose<double> pose = standing;
    for (int k = 1; k < kNumBodyJoints; ++k) {
      pose.rotation[k] =
          pose.rotation[k] * ExpSO3({0.2 * std::sin(0.3 * t + k), 0.1 * std::cos(0.2 * t), 0.05});
    }
    const double share = double(t) / num_frames;
    WriteState<double>(Moved(pose, 1.5 * share, {0.3 * share, -4.0 * share, 0.01 * std::sin(t)},
                             DefaultBody().rest_joints.col(0)),
                       states.col(t));
  }
  return states;
}

TEST(MotionStates, AClipComesBackWithItsJoints) {
  Clip clip = ReachClip();
  clip.betas = Eigen::Vector2d(0.5, -1.0);
  clip.subject = "s7";
  // Angles beyond half a turn are the same rotation, written differently.
  clip.pose[3].col(18) *= 1.0 + 2.0 * M_PI / clip.pose[3].col(18).norm();
  const StateMatrix<double> states = StatesOfClip(clip);
  const Clip back = ClipOfStates(states, clip);
  ASSERT_EQ(back.NumFrames(), clip.NumFrames());
  EXPECT_EQ(back.frame_rate, 30.0);
  EXPECT_EQ(back.trans, clip.trans);
  EXPECT_EQ(back.betas, clip.betas);
  EXPECT_EQ(back.subject, "s7");
  for (int t = 0; t < clip.NumFrames(); ++t) {
    for (int k = 0; k < kNumBodyJoints; ++k) {
      const Eigen::Matrix3d found = ExpSO3(back.pose[t].col(k));
      ASSERT_LT((found - ExpSO3(clip.pose[t].col(k))).norm(), 1e-12) << t << ", " << k;
    }
    if (t > 0) {
      ASSERT_LT((back.pose[t] - back.pose[t - 1]).cwiseAbs().maxCoeff(), 3.2) << "jumps";
    }
    EXPECT_EQ(back.pose[t].rightCols<kNumJoints - kNumBodyJoints>().norm(), 0.0);
  }
  EXPECT_LT((StatesOfClip(back) - states).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(MotionStates, OtherFrameRatesBecomeThirty) {
  Clip clip = ReachClip();
  clip.frame_rate = 120.0;
  const int frames = clip.NumFrames();
  EXPECT_EQ(StatesOfClip(clip).cols(), (frames - 1) / 4 + 1);
  EXPECT_THROW(StatesOfClip(Clip{}), Error);
}

TEST(MotionStates, StartsAreFramesWithTheirDelta) {
  const StateMatrix<double> states = StatesOfClip(ReachClip());
  const Normalizer<double> normalizer(testing::WalkingStatistics());
  const RolloutStart<double> start = StartAtFrame(states, 10, normalizer);
  EXPECT_LT((StateOf(start.pose) - states.col(10)).norm(), 1e-14);
  // Taking the delta from the frame before leads here.
  Pose<double> before = PoseOf<double>(states.col(9)), here;
  ApplyDelta<double>(before, HeadingOf<double>(before.rotation[0]),
                     DeltaOfNormalized<double>(normalizer, start.previous_delta), here);
  EXPECT_LT((StateOf(here) - states.col(10)).norm(), 1e-12);
  const StateVector<double> rest =
      DeltaOfNormalized<double>(normalizer, StartAtFrame(states, 0, normalizer).previous_delta);
  EXPECT_LT((rest - RestDelta<double>()).norm(), 1e-12);
  EXPECT_THROW(StartAtFrame(states, -1, normalizer), Error);
  EXPECT_THROW(StartAtFrame(states, static_cast<int>(states.cols()), normalizer), Error);
}

TEST(MotionStates, StandingIsOnTheGroundWithHangingArms) {
  const Pose<double> pose = StandingPose(DefaultBody());
  BodyKinematics<double> at;
  ForwardKinematics(DefaultBones(), pose, at);
  EXPECT_LT(at.joints.col(0).head<2>().norm(), 1e-12);
  const Clip clip = ClipOfStates(StateOf(pose));
  BodyState state;
  Forward(BodySurface(BodyModel::Default()), clip.pose[0], clip.trans.col(0), state);
  EXPECT_NEAR(state.vertices.row(2).minCoeff(), 0.0, 1e-3) << "soles on the ground";
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const Eigen::Vector3d wrist = at.joints.col(WristJoint(side));
    EXPECT_LT(wrist.z(), at.joints(2, 0) + 0.05) << "wrists at the height of the hips";
    EXPECT_LT(std::abs(wrist.x()), 0.45);
    EXPECT_LT(wrist.y(), at.joints(1, 0)) << "a little ahead";
    EXPECT_EQ(wrist.x() > 0.0, side == Side::kLeft) << "facing -y, the left is at +x";
  }
}

TEST(MotionStates, AMirrorSwapsTheSides) {
  const Eigen::Matrix3Xd& rest = DefaultBody().rest_joints;
  // Bones made symmetric, so that the law is exact.
  Eigen::Matrix3Xd symmetric = rest;
  for (int k = 0; k < kNumBodyJoints; ++k) {
    const Eigen::Vector3d other = rest.col(MirrorJoint(k));
    symmetric.col(k) = 0.5 * (rest.col(k) + Eigen::Vector3d(-other.x(), other.y(), other.z()));
  }
  const BoneOffsets<double> bones = BoneOffsetsOf(symmetric);
  nn::RandomStream random(41);
  const Pose<double> pose = testing::RandomPose(random, 0.8);
  const Pose<double> mirrored = Mirrored(pose, symmetric.col(0));
  BodyKinematics<double> here, there;
  ForwardKinematics(bones, pose, here);
  ForwardKinematics(bones, mirrored, there);
  for (int k = 0; k < kNumBodyJoints; ++k) {
    const Eigen::Vector3d other = here.joints.col(MirrorJoint(k));
    EXPECT_LT((there.joints.col(k) - Eigen::Vector3d(-other.x(), other.y(), other.z())).norm(),
              1e-12);
  }
  EXPECT_LT((StateOf(Mirrored(mirrored, symmetric.col(0))) - StateOf(pose)).norm(), 1e-13);
}

TEST(Statistics, AreThoseOfTheFrames) {
  const StateMatrix<double> states = WalkingStates(60);
  StatisticsGatherer gatherer;
  gatherer.Add(states.leftCols(25));
  gatherer.Add(states.rightCols(35));
  const Statistics s = gatherer.Finish();
  EXPECT_LT((s.body_pose.mean - states.bottomRows<126>().rowwise().mean()).norm(), 1e-12);
  const Eigen::MatrixXd centerd = states.topRows<3>().colwise() - s.body_transl.mean;
  EXPECT_LT((s.body_transl.deviation - (centerd.rowwise().squaredNorm() / 59.0).cwiseSqrt()).norm(),
            1e-12);
  EXPECT_EQ(s.body_orient_xy.mean[3], 0.0);
  EXPECT_EQ(s.body_orient_xy.deviation[3], 0.0);
  // Deltas do not see where sequences begin: theirs are at rest.
  StateVector<double> sum = 2.0 * RestDelta<double>();
  for (int t = 1; t < 60; ++t) {
    if (t == 25) continue;
    sum += DeltaBetween(PoseOf<double>(states.col(t - 1)), PoseOf<double>(states.col(t)));
  }
  EXPECT_LT((s.body_transl_delta_pelv_xy.mean - sum.head<3>() / 60.0).norm(), 1e-13);
  EXPECT_LT((s.body_pose_delta.mean - sum.tail<126>() / 60.0).norm(), 1e-12);
  EXPECT_THROW(StatisticsGatherer{}.Finish(), Error);
}

}  // namespace
}  // namespace holdfast::wandr
