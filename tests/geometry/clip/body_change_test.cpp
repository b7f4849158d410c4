// SPDX-License-Identifier: MIT
#include "geometry/clip/clip_body.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/body/skeleton.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/import/import_file.h"
#include "geometry/import/load_clip.h"
#include "tests/support/moving_clip.h"
#include "tests/support/smplh_like.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::MakeMovingClip;
using ::testing::Not;
using testing::TemporaryFolder;

const Eigen::Vector3d kOfSmplx(0.0031, -0.3514, 0.0120), kOfSmplh(-0.0018, -0.2233, 0.0282);

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

// The embedded body's J_0 is SMPL-X's.
TEST(BodyChange, TransOfAnSmplxClipStaysOnTheEmbeddedBody) {
  Clip clip = MakeMovingClip(5, 1);
  clip.betas = Eigen::VectorXd::Constant(10, 1.0);
  const Eigen::Matrix3Xd before = clip.trans;
  const ClipBody body{BodyModel::Default(), {}};
  const auto change = BringOntoBody(clip, body);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->from, "SMPL-X");
  EXPECT_EQ(clip.trans, before);
  EXPECT_LT((Pelvises(clip, body).colwise() - kOfSmplx - before).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_THAT(Describe(*change, *body.model), HasSubstr("made with SMPL-X: limbs and hands"));
  EXPECT_THAT(Describe(*change, *body.model), Not(HasSubstr("trans")));
  EXPECT_EQ(clip.body_model, "holdfast_neutral");
}

TEST(BodyChange, ThePelvisOfAnSmplhClipStaysOnTheEmbeddedBody) {
  Clip clip = MakeMovingClip(5, 1);
  clip.surface_model_type = "smplh";
  clip.betas = Eigen::VectorXd::Constant(10, 1.0);
  const Eigen::Matrix3Xd wanted = clip.trans.colwise() + kOfSmplh;
  const ClipBody body{BodyModel::Default(), {}};
  const auto change = BringOntoBody(clip, body);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->from, "SMPL-H");
  EXPECT_LT((Pelvises(clip, body) - wanted).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_THAT(Describe(*change, *body.model),
              HasSubstr("trans is moved by (-0.005, 0.128, 0.016)"));
  EXPECT_EQ(clip.body_model, "holdfast_neutral");
  EXPECT_TRUE(clip.betas.isZero(0.0));
  // Once is enough.
  EXPECT_FALSE(BringOntoBody(clip, body));
}

// A subject's own surface has its own J_0, betas have theirs.
TEST(BodyChange, FromTheEmbeddedBodyThePelvisStaysWhateverTheShape) {
  const TemporaryFolder folder;
  testing::WriteSmplhLike(folder / "SMPLH_TEST.npz", {0.0, 0.13, 0.02});
  const ClipBody smplh{BodyModel::Load(folder / "SMPLH_TEST.npz"), {}};
  const auto embedded = BodyModel::Default();
  for (const bool own_surface : {false, true}) {
    Clip clip = MakeMovingClip(4, 3);
    clip.body_model = "holdfast_neutral";
    if (own_surface) {
      clip.v_template = embedded->Template().colwise() - kOfSmplx;
    } else {
      clip.betas = Eigen::VectorXd::Constant(10, 1.0);
    }
    std::vector<std::string> notes;
    const Eigen::Matrix3Xd before = Pelvises(clip, BodyOfClip("clip", clip, embedded, notes));
    ASSERT_TRUE(BringOntoBody(clip, smplh));
    EXPECT_LT((Pelvises(clip, smplh) - before).cwiseAbs().maxCoeff(), 1e-12) << own_surface;
  }
}

// A clip as it was written when the embedded body's J_0 was the origin.
void WriteOld(Clip clip, const std::filesystem::path& path) {
  if (clip.v_template.cols() == 0) clip.trans.colwise() += kOfSmplx;
  NpzWriter all;
  AddArrays(clip, all);
  all.Write(path);
  const NpzReader archive(path);
  NpzWriter writer;
  for (const std::string& key : archive.Keys()) {
    if (key != "rest_pelvis") writer.Add(key, archive.Read(key).array);
  }
  writer.Write(path);
}

TEST(BodyChange, OldClipsOfTheEmbeddedBodyStayWhereTheyWere) {
  const TemporaryFolder folder;
  Clip clip = MakeMovingClip(4, 3);
  clip.body_model = "holdfast_neutral";
  WriteClip(clip, folder / "new.npz");
  WriteOld(clip, folder / "old.npz");
  for (const char* name : {"new.npz", "old.npz"}) {
    const bool old = name[0] == 'o';
    const auto said = Contains(HasSubstr("trans is moved by (-0.003, 0.351, -0.012) m"));
    const LoadedClip loaded = LoadClip(folder / name);
    EXPECT_LT((loaded.clip.trans - clip.trans).cwiseAbs().maxCoeff(), 1e-15) << name;
    EXPECT_EQ(loaded.clip.object->trans, clip.object->trans);
    EXPECT_FALSE(loaded.change);
    const ImportedFile imported = ImportFile(folder / name, {});
    EXPECT_LT((imported.clip.trans - clip.trans).cwiseAbs().maxCoeff(), 1e-15) << name;
    if (old) {
      EXPECT_THAT(loaded.notes, said);
      EXPECT_THAT(imported.notes, said);
    } else {
      EXPECT_THAT(loaded.notes, Not(said));
      EXPECT_THAT(imported.notes, Not(said));
    }
    // Once is enough.
    WriteClip(loaded.clip, folder / "again.npz");
    EXPECT_EQ(ReadClip(folder / "again.npz").trans, loaded.clip.trans);
  }
  // The trans of a subject's own surface goes with that, and another model's with that.
  for (const bool own_surface : {true, false}) {
    Clip other = clip;
    if (own_surface) other.v_template = BodyModel::Default()->Template().colwise() - kOfSmplx;
    if (!own_surface) other.body_model = "SMPLX_NEUTRAL";
    if (!own_surface) other.trans.colwise() -= kOfSmplx;
    WriteOld(other, folder / "other.npz");
    EXPECT_LT((ReadClip(folder / "other.npz").trans - clip.trans).cwiseAbs().maxCoeff(), 1e-15);
  }
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
  EXPECT_LT(*near, 10.0);
  EXPECT_FALSE(WarnOfHeldDistance(clip, body, mesh));
  clip.object->trans.row(2).array() += 5.0;
  const auto far = MeasureHeldDistance(clip, body, mesh);
  ASSERT_TRUE(far);
  EXPECT_NEAR(*far, 5000.0, 600.0);
  ASSERT_TRUE(WarnOfHeldDistance(clip, body, mesh));
  clip.holding_hand.assign(6, 0);
  EXPECT_FALSE(MeasureHeldDistance(clip, body, mesh));
}

}  // namespace
}  // namespace holdfast
