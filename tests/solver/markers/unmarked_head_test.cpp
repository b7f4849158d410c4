// SPDX-License-Identifier: MIT
// A hand that goes through a head that nobody measured, and lips that are called to a place.
#include "solver/markers/unmarked_head.h"

#include <gtest/gtest.h>

#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kHeadFrames = 80;

struct UnmarkedHeadTest : ::testing::Test {
  std::shared_ptr<const BodyModel> model = BodyModel::Default();
  BodySurface surface{model};
  FaceMarks face = FindFaceMarks(surface);

  // The arm's pose with a finger nearest to the middle of the head.
  JointPose InTheHead() const {
    JointPose best = JointPose::Zero();
    double least = 1.0;
    BodyState state;
    for (double turn = -1.6; turn <= 1.6; turn += 0.2) {
      for (double lift = -1.6; lift <= 1.6; lift += 0.2) {
        for (double bend = 1.2; bend <= 2.6; bend += 0.2) {
          JointPose pose = JointPose::Zero();
          pose.col(kRightShoulder) = Eigen::Vector3d(0.0, turn, lift);
          pose(1, kRightElbow) = bend;
          ForwardJoints(surface.RestJoints(), pose, Eigen::Vector3d::Zero(), state);
          const Eigen::Vector3d middle =
              state.joints.col(kHead) + Eigen::Vector3d(-0.05, 0.06, 0.0);
          const double off = (state.joints.col(kRightWrist) - middle).norm();
          if (off > 0.1 && off < least) {
            least = off;
            best = pose;
          }
        }
      }
    }
    return best;
  }
  // The right hand in the head in the middle of the clip, beside the body before and after.
  Clip ToTheHead() const {
    const JointPose there = InTheHead();
    Clip clip;
    clip.frame_rate = 50.0;
    clip.trans.setZero(3, kHeadFrames);
    for (int t = 0; t < kHeadFrames; ++t) {
      const double share = std::max(0.0, 1.0 - std::abs(t - 40) / 20.0);
      JointPose pose = JointPose::Zero();
      pose.col(kRightShoulder) = (1.0 - share) * Eigen::Vector3d(0.0, 0.0, 0.9);
      pose += share * there;
      clip.pose.push_back(pose);
    }
    return clip;
  }
  static bool SameHead(const Clip& a, const Clip& b, int t) {
    return a.pose[t].col(kNeck) == b.pose[t].col(kNeck) &&
           a.pose[t].col(kHead) == b.pose[t].col(kHead);
  }
  Eigen::Vector3d LipsAt(const Clip& clip, int t) const {
    BodyState state;
    ForwardJoints(surface.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    return state.WorldFromJoint(kHead) * LipsOf(face);
  }
};

TEST_F(UnmarkedHeadTest, GivesWayToAHandSmoothlyAndComesBack) {
  Clip clip = ToTheHead();
  const Clip before = clip;
  const HeadReport report = PoseUnmarkedHead(model, {}, {}, clip);
  ASSERT_GT(report.deep_before, 3) << "the hand does not reach the head";
  EXPECT_LT(report.deep, report.deep_before / 2);
  EXPECT_LT(report.worst_m, report.worst_before_m);
  EXPECT_TRUE(SameHead(clip, before, 0));
  EXPECT_FALSE(SameHead(clip, before, 40));
  for (int t = 2; t < kHeadFrames; ++t) {
    const Eigen::Vector3d second =
        clip.pose[t].col(kNeck) - 2.0 * clip.pose[t - 1].col(kNeck) + clip.pose[t - 2].col(kNeck);
    EXPECT_LT(second.norm() * 50.0 * 50.0, 150.0) << t;
    // All but neck and head stays.
    JointPose rest = clip.pose[t] - before.pose[t];
    rest.col(kNeck).setZero();
    rest.col(kHead).setZero();
    EXPECT_TRUE(rest.isZero(0.0)) << t;
  }
}

TEST_F(UnmarkedHeadTest, StaysWhereNothingIsNear) {
  Clip clip = ToTheHead();
  for (JointPose& pose : clip.pose) pose.col(kRightShoulder) = Eigen::Vector3d(0.0, 0.0, 1.2);
  const Clip before = clip;
  const HeadReport report = PoseUnmarkedHead(model, {}, {}, clip);
  EXPECT_EQ(report.moved, 0);
  for (int t = 0; t < kHeadFrames; ++t) EXPECT_TRUE(SameHead(clip, before, t));
}

TEST_F(UnmarkedHeadTest, BringsLipsToAPlaceInReachOfTheNeck) {
  Clip clip = ToTheHead();
  for (JointPose& pose : clip.pose) pose.col(kRightShoulder) = Eigen::Vector3d(0.0, 0.0, 1.2);
  std::vector<HeadWish> wishes(kHeadFrames);
  const Eigen::Vector3d place = LipsAt(clip, 0) + Eigen::Vector3d(0.01, -0.02, 0.03);
  for (int t = 30; t < 50; ++t) wishes[t].lips = place;
  PoseUnmarkedHead(model, {}, wishes, clip);
  EXPECT_LT((LipsAt(clip, 40) - place).norm(), 0.004);
  EXPECT_GT((LipsAt(clip, 0) - place).norm(), 0.03);
}

}  // namespace
}  // namespace holdfast
