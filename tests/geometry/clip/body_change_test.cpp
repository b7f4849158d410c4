// SPDX-License-Identifier: MIT
#include "geometry/clip/body_change.h"

#include <gtest/gtest.h>

#include "geometry/import/held_distance.h"
#include "tests/support/moving_clip.h"

namespace holdfast {
namespace {

using testing::MakeMovingClip;

Eigen::Matrix3Xd Pelvises(const Clip& clip, const ClipBody& body) {
  const BodySurface surface(body.model, body.betas);
  Eigen::Matrix3Xd pelvises(3, clip.NumFrames());
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(surface.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    pelvises.col(t) = state.joints.col(0);
  }
  return pelvises;
}

TEST(BodyChange, ThePelvisOfAnSmplxClipStaysOnTheEmbeddedBody) {
  const Eigen::Vector3d smplx(0.0031, -0.3514, 0.0120);
  Clip clip = MakeMovingClip(5, 1);
  clip.betas = Eigen::VectorXd::Constant(10, 1.0);
  const Eigen::Matrix3Xd wanted = clip.trans.colwise() + smplx;
  const ClipBody body{BodyModel::Default(), {}};
  const auto change = BringOntoBody(clip, body);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->from, "SMPL-X");
  EXPECT_LT((Pelvises(clip, body) - wanted).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(clip.body_model, "holdfast_neutral");
  EXPECT_TRUE(clip.betas.isZero(0.0));
  // Once is enough.
  EXPECT_FALSE(BringOntoBody(clip, body));
}

TEST(BodyChange, ClipsOfTheSameKindOfModelStayAsTheyAre) {
  Clip clip = MakeMovingClip(3, 2);
  clip.body_model = "holdfast_neutral";
  EXPECT_FALSE(BringOntoBody(clip, {BodyModel::Default(), {}}));
  clip.body_model.clear();
  clip.surface_model_type = "mano";
  EXPECT_FALSE(BringOntoBody(clip, {BodyModel::Default(), {}}));
}

// BodyOfClip makes it the body: what is measured on that body must be in the clip too.
TEST(BodyChange, ASurfaceOfTheBodysOwnVerticesStays) {
  const std::shared_ptr<const BodyModel> model = BodyModel::Default();
  Eigen::VectorXd tall(2);
  tall << 3.0, 1.0;
  Clip clip = MakeMovingClip(3, 4);
  clip.v_template = model->ShapedVertices(tall);
  std::vector<std::string> notes;
  const ClipBody body = BodyOfClip("clip", clip, model, notes);
  ASSERT_TRUE(BringOntoBody(clip, body));
  EXPECT_EQ(clip.v_template, model->ShapedVertices(tall));
  const ClipBody again = BodyOfClip("clip", clip, model, notes);
  EXPECT_EQ(again.model->Template(), body.model->Template());
  Clip of_others = MakeMovingClip(3, 4);
  of_others.v_template = clip.v_template.leftCols(10'475);
  ASSERT_TRUE(BringOntoBody(of_others, {model, {}}));
  EXPECT_EQ(of_others.v_template.cols(), 0);
}

TEST(BodyChange, HandsThatHoldAreMeasuredToTheObject) {
  const ClipBody body{BodyModel::Default(), {}};
  Clip clip = MakeMovingClip(6, 3);
  const TriangleMesh mesh = testing::Tetrahedron();
  EXPECT_FALSE(MeasureHeldDistance(clip, body, mesh));  // nobody says that a hand holds
  clip.holding_hand.assign(6, kHoldsRight);
  const BodySurface surface(body.model, body.betas);
  BodyState state;
  for (int t = 0; t < 6; ++t) {
    ForwardJoints(surface.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    clip.object->trans.col(t) = state.joints.col(WristJoint(Side::kRight));
  }
  const auto near = MeasureHeldDistance(clip, body, mesh);
  ASSERT_TRUE(near);
  EXPECT_EQ(near->frames, 6);
  EXPECT_LT(near->median_mm, 10.0);
  EXPECT_FALSE(WarnOfHeldDistance(clip, body, mesh));
  clip.object->trans.row(2).array() += 5.0;
  const auto far = MeasureHeldDistance(clip, body, mesh);
  ASSERT_TRUE(far);
  EXPECT_NEAR(far->median_mm, 5000.0, 600.0);
  ASSERT_TRUE(WarnOfHeldDistance(clip, body, mesh));
  clip.holding_hand.assign(6, 0);
  EXPECT_FALSE(MeasureHeldDistance(clip, body, mesh));
}

}  // namespace
}  // namespace holdfast
