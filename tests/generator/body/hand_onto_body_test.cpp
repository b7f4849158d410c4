// SPDX-License-Identifier: MIT
#include "generator/body/hand_onto_body.h"

#include <gtest/gtest.h>

#include "geometry/body/hand_model.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/retarget/convert_parameters.h"
#include "tests/support/mano_like.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

Clip DemoClip() {
  const EmbeddedFile file = FindEmbedded("clips/demo_drink.npz");
  return Slice(ReadClip(NpzReader(file.bytes, "demo_drink")), 0, 20);
}

TEST(HandOntoBody, BringsTheWristBackAfterTheArmWasMoved) {
  const testing::TemporaryFolder folder;
  testing::WriteManoLike(folder / "MANO_RIGHT.npz", Side::kRight);
  const auto mano = BodyModel::Load(folder / "MANO_RIGHT.npz");
  const auto body = BodyModel::Default();
  const Clip clip = DemoClip();
  const Clip hand = ConvertClip(clip, body, {}, mano).clip;
  Clip other = clip;
  for (JointPose& pose : other.pose) {
    pose.col(17) += Eigen::Vector3d(0.05, 0.1, -0.05);  // the right shoulder
    pose.col(19) += Eigen::Vector3d(0.0, 0.2, 0.0);
    SetFingers(pose, Side::kRight, FingerPose::Zero());
  }
  const HandOntoBodyReport report = PutHandOntoBody(hand, *mano, hand.betas, *body, {}, other);
  EXPECT_EQ(report.frames_out_of_reach, 0);
  const auto rest = [](const BodyModel& model, const Eigen::VectorXd& betas) {
    return model.RestJoints(model.ShapedVertices(betas));
  };
  for (const JointResidual& joint : CompareJoints(hand, rest(*mano, hand.betas), other,
                                                  rest(*body, {}), CommonJoints(*mano, *body))) {
    EXPECT_LT(joint.max_mm, 0.1) << kJointNames[static_cast<std::size_t>(joint.joint)];
  }
  EXPECT_EQ(other.trans, clip.trans);
  EXPECT_EQ(other.pose[3].leftCols<16>(), clip.pose[3].leftCols<16>());
}

TEST(HandOntoBody, SaysHowFarItIsOutOfReach) {
  const testing::TemporaryFolder folder;
  testing::WriteManoLike(folder / "MANO_RIGHT.npz", Side::kRight);
  const auto mano = BodyModel::Load(folder / "MANO_RIGHT.npz");
  const auto body = BodyModel::Default();
  Clip clip = DemoClip();
  Clip hand = ConvertClip(clip, body, {}, mano).clip;
  hand.trans.row(2).array() += 5.0;
  const HandOntoBodyReport report = PutHandOntoBody(hand, *mano, hand.betas, *body, {}, clip);
  EXPECT_EQ(report.frames_out_of_reach, clip.NumFrames());
  EXPECT_GT(report.max_missing_mm, 3000.0);
  EXPECT_LT(report.max_missing_mm, 5000.0);
  EXPECT_THROW(PutHandOntoBody(Slice(hand, 0, 3), *mano, hand.betas, *body, {}, clip), Error);
  EXPECT_THROW(PutHandOntoBody(hand, *body, {}, *body, {}, clip), Error);
}

TEST(HandOntoBody, IsAConversionWithItsNumbers) {
  const testing::TemporaryFolder folder;
  testing::WriteManoLike(folder / "MANO_RIGHT.npz", Side::kRight);
  const ClipBody body{BodyModel::Default(), {}};
  const Clip clip = DemoClip();
  ClipBody mano{BodyModel::Load(folder / "MANO_RIGHT.npz"), {}};
  const Conversion there{ConvertClip(clip, body.model, {}, mano.model), {}};
  mano.betas = there.clip.betas;
  EXPECT_FALSE(ConversionJson(there).contains("arm"));
  Clip hand = there.clip;
  hand.holding_hand.assign(static_cast<std::size_t>(clip.NumFrames()), kHoldsRight);
  const Conversion back = ConvertOntoBody(hand, mano, clip, body);
  EXPECT_EQ(back.clip.holding_hand, hand.holding_hand);
  EXPECT_EQ(back.clip.trans, clip.trans);
  EXPECT_EQ(back.joints.size(), 16u);
  const nlohmann::json json = ConversionJson(back);
  EXPECT_EQ(json["arm"]["frames_out_of_reach"], 0);
  EXPECT_EQ(json["residual"]["joints"].size(), 16u);
  EXPECT_LT(json["residual"]["max_mm"].get<double>(), 0.1);
  EXPECT_EQ(json["not_carried_over"].size(), 1u);
  EXPECT_THROW(ConvertOntoBody(hand, mano, Slice(clip, 0, 3), body), Error);
}

}  // namespace
}  // namespace holdfast
