// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/import/grab_sequence.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/support/imported.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::testing {
namespace {

const std::filesystem::path kSequence = Fixture("parameters/grab/grab/s1/mug_drink_1.npz");

TEST(ImportGrab, ObjectAndTableLieWhereGrabsRowVectorsPutThem) {
  const ImportedFile imported = Import(kSequence);
  ASSERT_TRUE(imported.clip.object && imported.clip.table);
  const Eigen::MatrixXd cube = Expected("grab.cube");
  const Eigen::MatrixXd object = Expected("grab.object"), table = Expected("grab.table");
  EXPECT_LT(MaxDifference(Posed(cube, *imported.clip.object), object), 2e-6);
  EXPECT_LT(MaxDifference(Posed(cube, *imported.clip.table), table), 2e-6);
  // The rotations are large enough to tell: read for columns they are elsewhere.
  ObjectTrack columns = *imported.clip.object;
  columns.orient = -columns.orient;
  EXPECT_GT(MaxDifference(Posed(cube, columns), object), 0.02);
}

TEST(ImportGrab, BodyIsFullposeWithTheSubjectsSurfaceAndBetas) {
  const Clip clip = Import(kSequence).clip;
  EXPECT_EQ(clip.frame_rate, 120);
  EXPECT_EQ(clip.gender, "male");
  EXPECT_EQ(clip.subject, "s1");
  EXPECT_EQ(clip.action, "drink");
  EXPECT_EQ(clip.object->name, "mug");
  EXPECT_LT(MaxDifference(Joints(clip, 0, kNumJoints), Expected("grab.fullpose")), 1e-7);
  EXPECT_LT(MaxDifference(clip.trans, Expected("grab.transl")), 1e-7);
  ASSERT_EQ(clip.v_template.cols(), 12);
  EXPECT_LT(MaxDifference(clip.v_template, Expected("grab.subject")), 1e-7);
  EXPECT_LT(MaxDifference(clip.betas, Expected("grab.betas")), 1e-7);
}

TEST(ImportGrab, LabelsSayWhoHolds) {
  const ImportedFile imported = Import(kSequence);
  const Eigen::MatrixXd holding = Expected("grab.holding");
  ASSERT_EQ(imported.clip.holding_hand.size(), 6U);
  for (int t = 0; t < 6; ++t) EXPECT_EQ(imported.clip.holding_hand[t], holding(t)) << "frame " << t;
  ASSERT_TRUE(imported.clip.contact);
  EXPECT_EQ(imported.clip.contact->object.cast<double>(), Expected("grab.contact_object"));
  EXPECT_EQ(imported.clip.contact->body.cast<double>(), Expected("grab.contact_body"));
}

TEST(ImportGrab, EveryLabelOfAHandCountsAndNoOther) {
  for (int label = 0; label < 256; ++label) {
    const bool right = label == 22 || (label >= 41 && label <= 55);
    const bool left = label == 21 || (label >= 26 && label <= 40);
    const std::uint8_t byte = static_cast<std::uint8_t>(label);
    EXPECT_EQ(HandsTouching({&byte, 1}), (right ? kHoldsRight : 0) | (left ? kHoldsLeft : 0))
        << label;
  }
  EXPECT_EQ(HandsTouching({}), 0);
}

TEST(ImportGrab, FindsTheMeshInTheFoldersAbove) {
  const ImportedFile imported = Import(kSequence);
  EXPECT_EQ(ReadMesh(imported.object_mesh).NumVertices(), 8);
  EXPECT_EQ(imported.object_mesh.filename(), "mug.ply");
  EXPECT_EQ(imported.table_mesh.filename(), "table.ply");
}

TEST(ImportGrab, WithoutTheDataSetItSaysWhatIsMissing) {
  const TemporaryFolder folder;
  std::filesystem::copy(kSequence, folder / "mug_drink_1.npz");
  const ImportedFile alone = Import(folder / "mug_drink_1.npz");
  EXPECT_TRUE(alone.object_mesh.empty());
  EXPECT_EQ(alone.clip.v_template.cols(), 0);
  EXPECT_TRUE(Mentions(alone.notes, "tools/subject_meshes/male/s1.ply"));
  EXPECT_TRUE(Mentions(alone.notes, "tools/object_meshes/contact_meshes/mug.ply"));
  ImportFileOptions options;
  options.parameters.data_root = Fixture("parameters/grab");
  EXPECT_EQ(Import(folder / "mug_drink_1.npz", options).clip.v_template.cols(), 12);
  // The folder of sequences does as well.
  options.parameters.data_root = Fixture("parameters/grab/grab");
  EXPECT_EQ(Import(folder / "mug_drink_1.npz", options).clip.v_template.cols(), 12);
}

TEST(ImportGrab, CoefficientsNeedAModelAndTakeItsMeanHand) {
  const std::filesystem::path path = Fixture("parameters/grab_coefficients.npz");
  EXPECT_THAT(ImportFault(path), ::testing::AllOf(::testing::HasSubstr("left_hand_pose"),
                                                  ::testing::HasSubstr("24 coefficients"),
                                                  ::testing::HasSubstr("--hand-model")));
  ImportFileOptions options;
  const std::vector<std::filesystem::path> smplx = {Fixture("parameters/SMPLX_TEST.npz")};
  const std::vector<std::filesystem::path> mano = {Fixture("parameters/MANO_RIGHT.pkl"),
                                                   Fixture("parameters/MANO_LEFT.pkl")};
  for (const auto& models : {smplx, mano}) {
    options.parameters.hand_models = models;
    const Clip clip = Import(path, options).clip;
    const Eigen::MatrixXd left = Joints(clip, kLeftHandBegin, kJointsPerHand);
    const Eigen::MatrixXd right = Joints(clip, kRightHandBegin, kJointsPerHand);
    EXPECT_LT(MaxDifference(left, Expected("grab_coefficients.left")), 1e-6);
    EXPECT_LT(MaxDifference(right, Expected("grab_coefficients.right")), 1e-6);
  }
}

TEST(ImportGrab, AHandAloneIsManosInTheWorld) {
  ImportFileOptions options;
  options.parameters.hands = ImportedHands::kRightAlone;
  const Clip clip = Import(kSequence, options).clip;
  EXPECT_EQ(clip.surface_model_type, "mano");
  EXPECT_LT(MaxDifference(Joints(clip, 0, 1), Expected("grab.rhand_global_orient")), 1e-7);
  EXPECT_LT(MaxDifference(clip.trans, Expected("grab.rhand_transl")), 1e-7);
  EXPECT_LT(
      MaxDifference(Joints(clip, kRightHandBegin, kJointsPerHand), Expected("grab.rhand_fullpose")),
      1e-7);
  EXPECT_TRUE(Joints(clip, kLeftHandBegin, kJointsPerHand).isZero(0.0));
  EXPECT_EQ(clip.v_template.cols(), 8);
  // What the other hand holds is none of this clip's business.
  EXPECT_EQ(clip.holding_hand, (std::vector<std::uint8_t>{0, 1, 1, 1, 0, 0}));
}

TEST(ImportGrab, SurvivesItsOwnFileAndAnotherFrameRate) {
  const TemporaryFolder folder;
  ImportFileOptions options;
  options.frame_rate = 40;
  const ImportedFile imported = Import(kSequence, options);
  EXPECT_EQ(imported.source_frames, 6);
  EXPECT_EQ(imported.source_frame_rate, 120);
  EXPECT_EQ(imported.clip.NumFrames(), 2);
  EXPECT_EQ(imported.clip.table->trans.cols(), 2);
  EXPECT_EQ(imported.clip.contact->object.cols(), 2);
  WriteClip(imported.clip, folder / "clip.npz");
  const Clip again = ReadClip(folder / "clip.npz");
  EXPECT_EQ(again.table->orient, imported.clip.table->orient);
  EXPECT_EQ(again.contact->object, imported.clip.contact->object);
  EXPECT_EQ(again.v_template, imported.clip.v_template);
  EXPECT_EQ(again.action, "drink");
}

}  // namespace
}  // namespace holdfast::testing
