// SPDX-License-Identifier: MIT
#include "generator/imos/action_sequence.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/imos/action_set.h"
#include "generator/imos/vocabulary.h"
#include "geometry/body/body_model.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "tests/support/action_scene.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::imos {
namespace {

using holdfast::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const Eigen::Matrix3Xd& RestJoints() { return wandr::testing::DefaultBody().rest_joints; }

// 120 Hz; the object is touched, by its labels, from frame 10 to frame 10 + `frames`.
Clip CapturedClip(int frames, int length = 200) {
  Clip clip = testing::ComposedActionClip(0, 0);
  clip = Slice(clip, 0, 1);
  clip.frame_rate = 120.0;
  clip.pose.assign(length, clip.pose[0]);
  clip.trans = clip.trans.col(0).replicate(1, length);
  for (int t = 0; t < length; ++t) clip.trans(0, t) = 0.01 * t;
  clip.object->trans = clip.object->trans.col(0).replicate(1, length);
  clip.object->orient = clip.object->orient.col(0).replicate(1, length);
  clip.holding_hand.assign(length, kHoldsRight);  // not what counts where there are labels
  clip.contact.emplace();
  clip.contact->object.setZero(5, length);
  for (int t = 10; t <= 10 + frames; ++t) clip.contact->object(t % 5, t) = 41;
  return clip;
}

TEST(KeyFrames, TheWholeRuleSpreadsThemFromTheFirstFrameToTheLast) {
  const Clip clip = testing::ComposedActionClip(0, 0);
  const Clip keys = KeyFramesOf(clip, KeyFrameRule::kWhole);
  ASSERT_EQ(keys.NumFrames(), kNumKeyFrames);
  const double seconds = (clip.NumFrames() - 1) / clip.frame_rate;
  EXPECT_NEAR(1.0 / keys.frame_rate, seconds / 14.0, 1e-12);
  EXPECT_LT((keys.trans.col(14) - clip.trans.rightCols(1)).norm(), 1e-9);
  EXPECT_LT((keys.pose[14] - clip.pose.back()).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(KeyFrames, ThePaperRuleTakesTheFirstFifteenTwentiethsOfTheContact) {
  const Clip clip = CapturedClip(119);  // s = floor(119 / 20) = 5
  const Clip keys = KeyFramesOf(clip, KeyFrameRule::kPaper);
  ASSERT_EQ(keys.NumFrames(), kNumKeyFrames);
  EXPECT_DOUBLE_EQ(keys.frame_rate, 24.0);
  for (int k = 0; k < kNumKeyFrames; ++k) {
    EXPECT_DOUBLE_EQ(keys.trans(0, k), 0.01 * (10 + 5 * k)) << k;
  }
}

TEST(KeyFrames, ThePaperRuleNeedsTwentyFramesOfContact) {
  EXPECT_EQ(LackOfKeyFrames(CapturedClip(20), KeyFrameRule::kPaper), std::nullopt);
  EXPECT_THAT(*LackOfKeyFrames(CapturedClip(19), KeyFrameRule::kPaper), HasSubstr("20 frames"));
  Clip untouched = CapturedClip(30);
  untouched.contact->object.setZero();
  EXPECT_THAT([&] { KeyFramesOf(untouched, KeyFrameRule::kPaper); },
              ThrowsMessage<Error>(HasSubstr("no contact")));
  EXPECT_THAT([&] { KeyFramesOf(Slice(CapturedClip(30), 0, 14), KeyFrameRule::kWhole); },
              ThrowsMessage<Error>(HasSubstr("14 frames")));
}

TEST(ActionSequence, BeginsAtTheOriginFacingAlongMinusY) {
  // Somewhere else, turned.
  Clip clip = testing::ComposedActionClip(0, 0);
  const Eigen::Matrix3d turn = ExpSO3({0.0, 0.0, 2.1});
  const Eigen::Vector3d pelvis = RestJoints().col(0), by(1.0, -2.0, 0.1);
  const ActionSequence here = SequenceFromClip(clip, RestJoints());
  for (int t = 0; t < clip.NumFrames(); ++t) {
    clip.trans.col(t) = turn * (clip.trans.col(t) + pelvis) - pelvis + by;
    clip.pose[t].col(0) = LogSO3(turn * ExpSO3(clip.pose[t].col(0)));
    clip.object->trans.col(t) = turn * clip.object->trans.col(t) + by;
    clip.object->orient.col(t) = LogSO3(turn * ExpSO3(clip.object->orient.col(t)));
  }
  const ActionSequence there = SequenceFromClip(clip, RestJoints());
  EXPECT_LT(here.transl.col(0).norm(), 1e-12);
  EXPECT_LT(there.transl.col(0).norm(), 1e-12);
  const Eigen::Vector3d lateral = there.Rotation(0, 0).col(0);
  EXPECT_NEAR(lateral.y(), 0.0, 1e-9);
  EXPECT_GT(lateral.x(), 0.5);
  // The same sequence, wherever it happened.
  EXPECT_LT((here.pose - there.pose).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((here.joints - there.joints).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((here.object_transl - there.object_transl).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((here.object_rotation - there.object_rotation).cwiseAbs().maxCoeff(), 1e-9);
  // And the way back.
  const Clip keys = KeyFramesOf(clip, KeyFrameRule::kWhole);
  for (int k = 0; k < kNumKeyFrames; ++k) {
    EXPECT_LT((there.canonical.TranslToWorld(there.transl.col(k)) - keys.trans.col(k)).norm(),
              1e-9);
    EXPECT_LT((there.canonical.PointToWorld(there.object_transl.col(k)) - keys.object->trans.col(k))
                  .norm(),
              1e-9);
    EXPECT_LT(AngleBetween(there.canonical.RotationToWorld(there.ObjectRotation(k)),
                           ExpSO3(keys.object->orient.col(k))),
              1e-6);
  }
}

TEST(ActionSequence, HasTheJointsOfItsPoses) {
  const Clip clip = testing::ComposedActionClip(1, 2);
  const ActionSequence sequence = SequenceFromClip(clip, RestJoints());
  const Clip keys = KeyFramesOf(clip, KeyFrameRule::kWhole);
  EXPECT_EQ(sequence.action, *FindAction("pass"));
  EXPECT_EQ(sequence.object, *FindObject("apple"));
  BodyState state;
  for (int k = 0; k < kNumKeyFrames; ++k) {
    ForwardJoints(RestJoints(), keys.pose[k], keys.trans.col(k), state);
    for (int j = 0; j < kNumBodyJoints; ++j) {
      const Eigen::Vector3d joint = sequence.joints.col(k).segment<3>(3 * j);
      EXPECT_LT((joint - sequence.canonical.PointFromWorld(state.joints.col(j))).norm(), 1e-9);
    }
  }
}

TEST(ActionSequence, KnowsWhoCarriesTheObject) {
  Clip clip = testing::ComposedActionClip(1, 0);
  clip.holding_hand.clear();  // nothing says so: it shows
  const ActionSequence sequence = SequenceFromClip(clip, RestJoints());
  // Nobody is told apart while all rest; once the wrist moves, it is the right one.
  for (int k = 6; k < 10; ++k) EXPECT_EQ(sequence.carriers[k], Carrier::kRightWrist) << k;
  const ActionSequence mirrored = Mirrored(sequence);
  for (int k = 6; k < 10; ++k) EXPECT_EQ(mirrored.carriers[k], Carrier::kLeftWrist) << k;
  // Carried so, it ends where it ended.
  const wandr::BoneOffsets<double> bones = wandr::BoneOffsetsOf(sequence.rest_joints);
  ObjectPose object{sequence.ObjectRotation(0), sequence.object_transl.col(0)};
  wandr::BodyKinematics<double> from, to;
  ForwardKinematics(bones, sequence.BodyPose(0), from);
  for (int k = 1; k < kNumKeyFrames; ++k) {
    ForwardKinematics(bones, sequence.BodyPose(k), to);
    object = Carried(object, Carrier::kRightWrist, from, to);
    from = to;
    EXPECT_LT((object.T - sequence.object_transl.col(k)).norm(), 2e-3) << k;
    EXPECT_LT(AngleBetween(object.R, sequence.ObjectRotation(k)), 2e-2) << k;
  }
}

TEST(ActionSequence, TwoMirrorsMakeItWhatItWas) {
  const ActionSequence sequence = testing::ComposedSequence(0, 3);
  const ActionSequence mirrored = Mirrored(sequence);
  EXPECT_EQ(mirrored.hands[5], kHoldsLeft);
  for (int k = 0; k < kNumKeyFrames; ++k) {
    for (int j = 0; j < kNumBodyJoints; ++j) {
      Eigen::Vector3d seen = sequence.joints.col(k).segment<3>(3 * MirrorJoint(j));
      seen.x() = -seen.x();
      EXPECT_LT((mirrored.joints.col(k).segment<3>(3 * j) - seen).norm(), 1e-9);
    }
  }
  const ActionSequence twice = Mirrored(mirrored);
  EXPECT_LT((twice.pose - sequence.pose).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((twice.object_rotation - sequence.object_rotation).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((twice.transl - sequence.transl).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((twice.canonical.turn - sequence.canonical.turn).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ActionSet, IsSplitBySubject) {
  const TemporaryFolder folder;
  testing::WriteComposedSet(folder.Path(), 2, {"s1", "s2", "s3", "s10"});
  std::filesystem::create_directories(folder.Path() / "s2" / "dropped");
  std::ofstream(folder.Path() / "s2" / "dropped" / "bad.npz") << "not looked at";
  const ActionSet paper = ReadActionSet({folder.Path()}, BodyModel::Default());
  EXPECT_EQ(paper.train.size(), 4u);
  EXPECT_EQ(paper.validation.size(), 2u);
  EXPECT_EQ(paper.test.size(), 2u);
  EXPECT_EQ(paper.test[0].subject, "s10");
  EXPECT_EQ(paper.test[0].name, "apple_pass_1");
  ActionSetOptions ours;
  ours.validation = {};
  ours.test = {"s3", "s10"};
  ours.without = {"pass"};
  ours.threads = 2;
  const ActionSet set = ReadActionSet({folder.Path()}, BodyModel::Default(), ours);
  EXPECT_EQ(set.train.size(), 2u);
  EXPECT_EQ(set.test.size(), 2u);
  ASSERT_EQ(set.notes.size(), 4u);
  EXPECT_THAT(set.notes[0], HasSubstr("action pass is excluded"));
}

TEST(ActionSet, NamesTheFileThatIsAtFault) {
  const TemporaryFolder folder;
  const auto refuses = [&](const Clip& clip, const std::string& what) {
    WriteClip(clip, folder.Path() / "odd.npz");
    EXPECT_THAT([&] { ReadActionSet({folder.Path()}, BodyModel::Default()); },
                ThrowsMessage<Error>(AllOf(HasSubstr("odd.npz"), HasSubstr(what))));
  };
  const Clip good = testing::ComposedActionClip(0, 0);
  Clip clip = good;
  clip.action = "drnk";
  refuses(clip, "drink");
  clip = good;
  clip.object->name = "mugg";
  refuses(clip, "mug");
  clip = good;
  clip.object.reset();
  refuses(clip, "no object");
  clip = good;
  clip.action.clear();
  refuses(clip, "action");
  refuses(Slice(good, 0, 5), "5 frames");
  EXPECT_THAT([&] { ReadActionSet({folder.Path() / "none"}, BodyModel::Default()); },
              ThrowsMessage<Error>(HasSubstr("is not a folder")));
}

}  // namespace
}  // namespace holdfast::imos
