// SPDX-License-Identifier: MIT
#include "solver/synthesis/motion_passes.h"

#include <gtest/gtest.h>

#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"

namespace holdfast {
namespace {

// The right hand goes up to the face with an object.
Clip Raises(const BodyMeasures& body) {
  ReachKey start, up;
  start.wrist = {-0.25, -0.25, 1.0};
  up.time_s = 1.0;
  up.wrist = {-0.15, -0.30, 1.4};
  Clip clip = MakeReachMotion(body, {start, up}, {.liveliness = 0.0});
  clip.object.emplace();
  clip.object->trans = clip.object->orient = Eigen::Matrix3Xd::Zero(3, clip.NumFrames());
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const BodyFrame frame = BodyFrames(clip, body.rest_joints)[t];
    clip.object->SetPose(t, Place(body.rest_joints, frame).WorldFromJoint(kRightWrist));
  }
  return clip;
}

// The last frame of it without and with a style.
struct LastFrames {
  BodyPlacement was, is;
};

LastFrames Styled(const SampleStyle& style) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  const Clip before = Raises(body);
  Clip after = before;
  ApplySampleStyle(style, body.rest_joints, after);
  const auto placed = [&](const Clip& clip) {
    return Place(body.rest_joints, BodyFrames(clip, body.rest_joints).back());
  };
  return {placed(before), placed(after)};
}

TEST(SampleStyle, TheFirstSampleHasNoneAndOthersDiffer) {
  EXPECT_EQ(DrawSampleStyle(1, 0, 1.0).pace, 1.0);
  EXPECT_EQ(DrawSampleStyle(1, 3, 0.0).pace, 1.0);
  EXPECT_EQ(DrawSampleStyle(1, 3, 1.0).pace, DrawSampleStyle(1, 3, 1.0).pace);
  EXPECT_NE(DrawSampleStyle(1, 3, 1.0).pace, DrawSampleStyle(1, 4, 1.0).pace);
  EXPECT_NE(DrawSampleStyle(1, 3, 1.0).trunk, DrawSampleStyle(2, 3, 1.0).trunk);
}

TEST(SampleStyle, TheFirstFrameStaysAndTheObjectStaysWithTheHand) {
  const BodyMeasures body = MeasureBody(*BodyModel::Default(), {});
  const Clip before = Raises(body);
  Clip after = before;
  const SampleStyle style = DrawSampleStyle(1, 3, 1.0);
  ApplySampleStyle(style, body.rest_joints, after);
  EXPECT_NEAR(after.frame_rate, before.frame_rate / style.pace, 1e-12);
  const std::vector<BodyFrame> was = BodyFrames(before, body.rest_joints);
  const std::vector<BodyFrame> is = BodyFrames(after, body.rest_joints);
  EXPECT_LT(
      (Place(body.rest_joints, is.front()).joints - Place(body.rest_joints, was.front()).joints)
          .cwiseAbs()
          .maxCoeff(),
      1e-9);
  EXPECT_GT((Place(body.rest_joints, is.back()).joints - Place(body.rest_joints, was.back()).joints)
                .colwise()
                .norm()
                .maxCoeff(),
            0.03);
  for (std::size_t t = 0; t < is.size(); ++t) {
    const Eigen::Isometry3d wrist = Place(body.rest_joints, is[t]).WorldFromJoint(kRightWrist);
    const Eigen::Isometry3d object = after.object->Pose(static_cast<Eigen::Index>(t));
    EXPECT_LT((wrist.matrix() - object.matrix()).cwiseAbs().maxCoeff(), 1e-6) << t;
  }
}

TEST(SampleStyle, AnElbowThatGoesOutLeavesTheHandWhereItIs) {
  SampleStyle style;
  style.elbow = 0.3;
  const auto [was, is] = Styled(style);
  EXPECT_LT((is.WorldFromJoint(kRightWrist).matrix() - was.WorldFromJoint(kRightWrist).matrix())
                .cwiseAbs()
                .maxCoeff(),
            1e-6);
  EXPECT_GT((is.joints.col(kRightElbow) - was.joints.col(kRightElbow)).norm(), 0.02);
}

TEST(SampleStyle, TheOtherForearmComesInBeforeTheBelly) {
  SampleStyle style;
  style.other_elbow = 1.0;
  const auto [was, is] = Styled(style);
  // The left forearm, elbow to wrist, in the chest's frame: x to the left, z ahead.
  const auto forearm = [](const BodyPlacement& placed) -> Eigen::Vector3d {
    return placed.rotation[kSpine3].transpose() *
           (placed.joints.col(kLeftWrist) - placed.joints.col(kLeftElbow));
  };
  EXPECT_GT(forearm(is).z() - forearm(was).z(), 0.05);
  EXPECT_LT(forearm(is).x() - forearm(was).x(), -0.15);  // -0.10 where the upper arm does not turn
}

TEST(SampleStyle, WeightGoesOverOneFootAndTheTrunkStaysUpright) {
  SampleStyle style;
  style.weight = {0.03, 0.0};
  const auto [was, is] = Styled(style);
  // A person who faces -y has +x on the left.
  EXPECT_NEAR((is.joints.col(kPelvis) - was.joints.col(kPelvis)).x(), 0.03, 1e-3);
  EXPECT_GT(is.joints(2, kLeftHip) - is.joints(2, kRightHip),
            was.joints(2, kLeftHip) - was.joints(2, kRightHip) + 0.003);
  EXPECT_LT((is.rotation[kSpine3] - was.rotation[kSpine3]).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace holdfast
