// SPDX-License-Identifier: MIT
// One object in both hands of a person whose wrists do not keep their distance.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "geometry/rotation.h"
#include "solver/fit/fit.h"
#include "tests/support/hand_scene.h"

namespace holdfast {
namespace {

using testing::HandScene;

constexpr int kFrames = 15;
constexpr std::uint8_t kBoth = kHoldsRight | kHoldsLeft;

struct TwoHandScene {
  TwoHandScene() : right(), left(right.model, {}, Side::kLeft) {
    JointPose pose = right.pose;
    const JointPose mirrored = MirrorPose(right.pose);
    for (const int joint : {16, 18, 20}) pose.col(joint) = mirrored.col(joint);
    for (int k = 0; k < kJointsPerHand; ++k) {
      pose.col(kLeftHandBegin + k) = mirrored.col(kLeftHandBegin + k);
    }
    clip.frame_rate = 30.0;
    clip.trans = right.trans.replicate(1, kFrames);
    for (int t = 0; t < kFrames; ++t) {
      JointPose moved = pose;
      moved.col(16) += Eigen::Vector3d(0.0, 0.006 * t, 0.0);  // the left arm alone drifts outwards
      clip.pose.push_back(moved);
    }
    object.vertices = right.object;
    clip.object.emplace();
    clip.object->trans = Eigen::Matrix3Xd::Zero(3, kFrames);
    clip.object->orient = Eigen::Matrix3Xd::Zero(3, kFrames);
    clip.object->trans.col(0) = 0.5 * (Wrist(Side::kRight, pose) + Wrist(Side::kLeft, pose));
  }
  const HandModel& Hand(Side side) const { return side == Side::kRight ? right.hand : left; }
  Eigen::Vector3d Wrist(Side side, const JointPose& pose) const {
    HandState state(Hand(side));
    state.SetBody(pose, right.trans);
    return state.WristPosition();
  }
  FitResult Fit(const FitOptions& options) const {
    const HandModel* const hands[] = {&right.hand, &left};
    const std::vector<std::uint8_t> holding(kFrames, kBoth);
    return FitClip(clip, hands, object, holding, options);
  }
  // How far the fingers' vertices have moved on the object between the first and the last frame.
  double Travel(const FitResult& result, Side side) const {
    Eigen::Matrix3Xd z[2];
    for (const int k : {0, 1}) {
      const int t = k == 0 ? 0 : kFrames - 1;
      HandState state(Hand(side));
      state.SetBody(result.clip.pose[t], result.clip.trans.col(t));
      state.Evaluate(FingersOf(result.clip.pose[t], side), false);
      z[k] = InObjectFrame(state.Vertices(),
                           Eigen::Quaterniond(ExpSO3(result.clip.object->orient.col(t))),
                           result.clip.object->trans.col(t));
    }
    // Skin that no finger moves is the wrist's, which bends with the arm.
    double farthest = 0.0;
    for (const HandModel::Group& group : Hand(side).Groups()) {
      if (group.joints.empty()) continue;
      for (const int i : group.vertices) {
        farthest = std::max(farthest, (z[1].col(i) - z[0].col(i)).norm());
      }
    }
    return farthest;
  }

  HandScene right;
  HandModel left;
  Clip clip;
  FitObject object;
};

TEST(TwoHands, StayWhereTheyAreOnTheObjectAndShareTheWay) {
  const TwoHandScene scene;
  const double drift = (scene.Wrist(Side::kLeft, scene.clip.pose.back()) -
                        scene.Wrist(Side::kLeft, scene.clip.pose.front()))
                           .norm();
  ASSERT_GT(drift, 0.02);
  FitOptions options;
  options.lambda_limits = 0.0;  // the scene's fingers are bent as no hand's are
  const FitResult result = scene.Fit(options);
  double moved[2];
  for (const Side side : {Side::kRight, Side::kLeft}) {
    EXPECT_LT(scene.Travel(result, side), 0.0025);
    moved[side == Side::kLeft] =
        (scene.Wrist(side, result.clip.pose.back()) - scene.Wrist(side, scene.clip.pose.back()))
            .norm();
  }
  EXPECT_GT(moved[0], 0.2 * drift);
  EXPECT_GT(moved[1], 0.2 * drift);
  EXPECT_LT(moved[0] + moved[1], 1.3 * drift);
  for (const FrameReport& frame : result.frames) EXPECT_NE(frame.stop, StopReason::kFailed);
}

TEST(TwoHands, TheInputsOfOneThreadAndTwoGiveTheSameNumbers) {
  const TwoHandScene scene;
  FitOptions two;
  two.threads = 2;
  const FitResult a = scene.Fit({}), b = scene.Fit(two);
  for (int t = 0; t < kFrames; ++t) {
    EXPECT_EQ(a.clip.pose[t], b.clip.pose[t]) << t;
    EXPECT_EQ(a.clip.object->trans.col(t), b.clip.object->trans.col(t)) << t;
  }
}

TEST(TwoHands, ThePapersTermsLeaveTheArmsAlone) {
  const TwoHandScene scene;
  const FitResult result = scene.Fit(FitOptions().OnlyPaper());
  for (int t = 0; t < kFrames; ++t) {
    EXPECT_EQ(result.clip.pose[t].leftCols<kNumBodyJoints>(),
              scene.clip.pose[t].leftCols<kNumBodyJoints>())
        << t;
  }
  // An object cannot follow two hands that part: it settles between them.
  EXPECT_GT(scene.Travel(result, Side::kLeft), 0.005);
}

}  // namespace
}  // namespace holdfast
