// SPDX-License-Identifier: MIT
#include "geometry/retarget/convert_parameters.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/body/hand_model.h"
#include "geometry/error.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/rotation.h"
#include "tests/support/error_text.h"
#include "tests/support/mano_like.h"
#include "tests/support/smplh_like.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

Clip RandomClip(int frames, unsigned seed) {
  std::srand(seed);
  Clip clip;
  clip.frame_rate = 60.0;
  clip.trans = Eigen::Matrix3Xd::Random(3, frames);
  for (int t = 0; t < frames; ++t) {
    JointPose pose = 0.4 * JointPose::Random();
    pose.middleCols<3>(22).setZero();
    clip.pose.push_back(pose);
  }
  return clip;
}

class ConvertTest : public ::testing::Test {
 protected:
  // Written and read once for all tests: they are large.
  static std::shared_ptr<const BodyModel> Smplh() {
    static const std::shared_ptr<const BodyModel> model = [] {
      const TemporaryFolder folder;
      testing::WriteSmplhLike(folder / "SMPLH.npz", Eigen::Vector3d(0.2, -0.1, 0.3));
      return BodyModel::Load(folder / "SMPLH.npz");
    }();
    return model;
  }
  static std::shared_ptr<const BodyModel> Mano(Side side) {
    const auto load = [](Side which) {
      const TemporaryFolder folder;
      testing::WriteManoLike(folder / "MANO.npz", which);
      return BodyModel::Load(folder / "MANO.npz");
    };
    static const std::shared_ptr<const BodyModel> right = load(Side::kRight);
    static const std::shared_ptr<const BodyModel> left = load(Side::kLeft);
    return side == Side::kRight ? right : left;
  }
  TemporaryFolder folder_;
};

TEST_F(ConvertTest, ToSmplhAndBackIsTheSameMotion) {
  const auto smplx = BodyModel::Default();
  const auto smplh = Smplh();
  Clip clip = RandomClip(4, 1);
  clip.betas = Eigen::VectorXd::LinSpaced(10, -1.0, 1.5);
  const ConvertedClip there = ConvertClip(clip, smplx, clip.betas, smplh);
  EXPECT_TRUE(there.lost.empty());
  EXPECT_EQ(there.clip.surface_model_type, "smplh");
  EXPECT_EQ(there.joints.size(), 52u);
  EXPECT_LT(there.max_mm, 1e-3);
  ASSERT_TRUE(there.vertex_max_mm);  // the same triangles
  EXPECT_LT(*there.vertex_max_mm, 1e-2);
  EXPECT_LT((there.clip.betas - clip.betas).cwiseAbs().maxCoeff(), 1e-5);
  // The pelvis's rest place has moved: so does trans, against it.
  const Eigen::Matrix3Xd rest = smplx->RestJoints(smplx->ShapedVertices(clip.betas));
  const Eigen::Matrix3Xd other = smplh->RestJoints(smplh->ShapedVertices(there.clip.betas));
  EXPECT_LT(((there.clip.trans - clip.trans).colwise() - (rest.col(0) - other.col(0)))
                .cwiseAbs()
                .maxCoeff(),
            1e-12);

  const ConvertedClip back = ConvertClip(there.clip, smplh, there.clip.betas, smplx);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    EXPECT_EQ(back.clip.pose[static_cast<std::size_t>(t)], clip.pose[static_cast<std::size_t>(t)]);
  }
  EXPECT_LT((back.clip.trans - clip.trans).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((back.clip.betas - clip.betas).cwiseAbs().maxCoeff(), 1e-4);
}

TEST_F(ConvertTest, WithoutBetasTheResidualIsTheShapesDifference) {
  const auto smplx = BodyModel::Default();
  const auto smplh = Smplh();
  Clip clip = RandomClip(2, 2);
  clip.pose = {JointPose::Zero(), JointPose::Zero()};
  clip.betas = 2.0 * Eigen::VectorXd::Unit(10, 4);  // longer arms
  const ConvertedClip mean = ConvertClip(clip, smplx, clip.betas, smplh, 0);
  EXPECT_EQ(mean.clip.betas.size(), 0);
  const Eigen::Matrix3Xd rest = smplx->RestJoints(smplx->ShapedVertices(clip.betas));
  const Eigen::Matrix3Xd plain = smplx->RestJoints(smplx->Template());
  for (const JointResidual& joint : mean.joints) {
    const double expected =
        1e3 * (rest.col(joint.joint) - rest.col(0) - plain.col(joint.joint) + plain.col(0)).norm();
    EXPECT_NEAR(joint.mean_mm, expected, 1e-3);
    EXPECT_NEAR(joint.max_mm, expected, 1e-3);
  }
  EXPECT_GT(mean.max_mm, 20.0);
}

TEST_F(ConvertTest, NamesWhatItLeavesBehind) {
  Clip clip = RandomClip(2, 3);
  clip.pose[1](1, 22) = 0.2;
  clip.pose[1](1, 24) = 0.2;
  const auto smplx = BodyModel::Default();
  const ConvertedClip smplh = ConvertClip(clip, smplx, {}, Smplh());
  EXPECT_THAT(smplh.lost, ::testing::ElementsAre("pose_jaw", "pose_eye"));
  EXPECT_TRUE(smplh.clip.pose[1].middleCols<3>(22).isZero(0.0));
  const ConvertedClip hand = ConvertClip(clip, smplx, {}, Mano(Side::kRight));
  EXPECT_THAT(hand.lost, Contains("the body's motion"));
  EXPECT_THAT(hand.lost, Contains("the left fingers"));
  clip.v_template = Eigen::Matrix3Xd::Zero(3, smplx->NumVertices());
  EXPECT_THAT(ConvertClip(clip, smplx, {}, Mano(Side::kRight)).lost,
              Contains(HasSubstr("v_template")));
}

TEST_F(ConvertTest, ASubjectsSurfaceGoesAlongToTheSameTriangles) {
  const auto smplx = BodyModel::Default();
  Clip clip = RandomClip(2, 4);
  clip.v_template = smplx->ShapedVertices(Eigen::VectorXd::Constant(10, 0.7));
  const auto subject = BodyModel::WithTemplate(smplx, clip.v_template);
  const ConvertedClip there = ConvertClip(clip, subject, {}, Smplh());
  EXPECT_EQ(there.clip.v_template, clip.v_template);
  EXPECT_LT(there.max_mm, 1e-9);
  EXPECT_LT(*there.vertex_max_mm, 1e-3);
}

TEST_F(ConvertTest, AHandCutOffABodyIsWhereTheBodyHasIt) {
  const auto smplx = BodyModel::Default();
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const auto mano = Mano(side);
    Clip clip = RandomClip(5, 5);
    clip.betas = Eigen::VectorXd::Unit(10, 5) - 0.5 * Eigen::VectorXd::Unit(10, 6);
    clip.holding_hand.assign(5, 3);
    const ConvertedClip hand = ConvertClip(clip, smplx, clip.betas, mano);
    EXPECT_EQ(hand.clip.surface_model_type, "mano");
    EXPECT_EQ(hand.joints.size(), 16u);
    EXPECT_LT(hand.max_mm, 0.1);  // its regressor is its own
    const BodySurface body(smplx, clip.betas, smplx->HandVertexIds(side));
    const BodySurface cut(mano, hand.clip.betas);
    BodyState a, b;
    for (int t = 0; t < 5; ++t) {
      const auto frame = static_cast<std::size_t>(t);
      EXPECT_EQ(hand.clip.holding_hand[frame], side == Side::kRight ? 1 : 2);
      EXPECT_TRUE(hand.clip.pose[frame].middleCols<21>(1).isZero(0.0));
      EXPECT_EQ(FingersOf(hand.clip.pose[frame], side), FingersOf(clip.pose[frame], side));
      Forward(body, clip.pose[frame], clip.trans.col(t), a);
      Forward(cut, hand.clip.pose[frame], hand.clip.trans.col(t), b);
      // Beyond the wrist's own crease, which the forearm shares.
      for (int i = 0; i < body.NumVertices(); ++i) {
        bool of_fingers = true;
        for (const auto& [joint, w] : body.Weights(i)) of_fingers &= joint >= kLeftHandBegin;
        if (of_fingers) {
          EXPECT_LT((a.vertices.col(i) - b.vertices.col(i)).norm(), 3e-4);
        }
      }
    }
    // And a hand to a hand is the same hand.
    const ConvertedClip again = ConvertClip(hand.clip, mano, hand.clip.betas, mano);
    EXPECT_LT(again.max_mm, 1e-4);
    EXPECT_TRUE(again.lost.empty());
  }
}

TEST_F(ConvertTest, RefusesWhatHasNoCommonJoints) {
  const Clip clip = RandomClip(1, 6);
  const auto right = Mano(Side::kRight);
  const auto left = Mano(Side::kLeft);
  EXPECT_THAT(testing::ErrorText([&] { ConvertClip(clip, right, {}, BodyModel::Default()); }),
              HasSubstr("--onto"));
  EXPECT_THROW(ConvertClip(clip, right, {}, left), Error);
}

TEST_F(ConvertTest, WritesTheNamesOfEachLayout) {
  Clip clip = RandomClip(3, 7);
  clip.betas = Eigen::VectorXd::LinSpaced(10, 0.0, 1.0);
  WriteParameters(clip, ModelKind::kSmplh, ParameterLayout::kAmass, true, folder_ / "amass.npz");
  const NpzReader amass(folder_ / "amass.npz");
  const NpyMember poses = amass.Read("poses");
  poses.RequireShape({3, 156});
  EXPECT_DOUBLE_EQ(poses.AsDoubles()[156 + 66], clip.pose[1](0, kLeftHandBegin));
  EXPECT_DOUBLE_EQ(poses.AsDoubles()[156 + 111], clip.pose[1](0, kRightHandBegin));
  EXPECT_DOUBLE_EQ(amass.Read("mocap_framerate").AsDoubles()[0], 60.0);

  WriteParameters(clip, ModelKind::kSmplx, ParameterLayout::kPackage, true, folder_ / "p.npz");
  const NpzReader package(folder_ / "p.npz");
  package.Read("body_pose").RequireShape({3, 63});
  package.Read("reye_pose").RequireShape({3, 3});
  EXPECT_EQ(package.Read("model_type").AsText(), "smplx");

  WriteParameters(clip, ModelKind::kManoLeft, ParameterLayout::kPackage, false,
                  folder_ / "hand.json");
  nlohmann::json hand;
  std::ifstream(folder_ / "hand.json") >> hand;
  EXPECT_FALSE(hand.contains("body_pose"));
  EXPECT_EQ(hand["is_rhand"], false);
  EXPECT_EQ(hand["flat_hand_mean"], false);
  ASSERT_EQ(hand["hand_pose"].size(), 3u);
  EXPECT_EQ(hand["hand_pose"][2][44].get<double>(), clip.pose[2](2, kLeftHandBegin + 14));
  EXPECT_EQ(hand["transl"][1][2].get<double>(), clip.trans(2, 1));

  EXPECT_THROW(
      WriteParameters(clip, ModelKind::kSmplx, ParameterLayout::kAmass, true, folder_ / "a.json"),
      Error);
  EXPECT_THROW(
      WriteParameters(clip, ModelKind::kSmplx, ParameterLayout::kPackage, true, folder_ / "a.pkl"),
      Error);
}

}  // namespace
}  // namespace holdfast
