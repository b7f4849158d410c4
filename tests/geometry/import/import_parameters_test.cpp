// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "geometry/body/body_model.h"
#include "geometry/error.h"
#include "geometry/import/amass.h"
#include "geometry/import/world_frame.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/support/imported.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::testing {
namespace {

using ::testing::HasSubstr;

ImportFileOptions Flat(bool flat = true) {
  ImportFileOptions options;
  options.parameters.flat_hand_mean = flat;
  return options;
}

ImportFileOptions WithHandModel() {
  ImportFileOptions options;
  options.parameters.hand_models = {Fixture("parameters/SMPLX_TEST.npz")};
  return options;
}

// --- AMASS ---

TEST(ImportAmass, PartsAndConcatenatedPosesAreTheSame) {
  const ImportedFile parts = Import(Fixture("parameters/amass_smplx_stageii.npz"));
  const ImportedFile poses = Import(Fixture("parameters/amass_poses_only.npz"));
  const Eigen::MatrixXd expected = Expected("amass.poses");
  for (const ImportedFile* imported : {&parts, &poses}) {
    EXPECT_EQ(imported->format, "AMASS, SMPL-X");
    EXPECT_LT((Joints(imported->clip, 0, kNumJoints) - expected).cwiseAbs().maxCoeff(), 1e-7);
    EXPECT_LT((imported->clip.trans - Expected("amass.trans")).cwiseAbs().maxCoeff(), 1e-7);
    EXPECT_LT((imported->clip.betas - Expected("amass.betas")).cwiseAbs().maxCoeff(), 1e-7);
  }
  EXPECT_EQ(parts.clip.frame_rate, 120);
  EXPECT_EQ(poses.clip.frame_rate, 100);
  EXPECT_EQ(parts.clip.gender, "female");
  EXPECT_EQ(poses.clip.gender, "male");  // "b'male'" in the file
  EXPECT_TRUE(Mentions(parts.dropped, "markers_latent"));
}

TEST(ImportAmass, SmplhHasItsHandsBehindTheBody) {
  const ImportedFile imported = Import(Fixture("parameters/amass_smplh_poses.npz"));
  const Eigen::MatrixXd expected = Expected("amass.smplh");
  const Clip& clip = imported.clip;
  EXPECT_EQ(imported.format, "AMASS, SMPL-H");
  EXPECT_EQ(clip.surface_model_type, "smplh");
  EXPECT_EQ(clip.frame_rate, 60);
  EXPECT_EQ(clip.gender, "male");  // bytes
  EXPECT_LT((Joints(clip, 0, 22) - expected.topRows(66)).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_TRUE(Joints(clip, 22, 3).isZero(0.0));
  EXPECT_LT((Joints(clip, 25, 30) - expected.bottomRows(90)).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_TRUE(Mentions(imported.dropped, "dmpls"));
}

// --- fitting codes ---

TEST(ImportParameters, SmplifyXIsAFolderAFrameInNaturalOrder) {
  const ImportedFile imported = Import(Fixture("parameters/smplifyx"), WithHandModel());
  const Clip& clip = imported.clip;
  ASSERT_EQ(clip.NumFrames(), 3);
  EXPECT_LT((Joints(clip, 1, 21) - Expected("smplifyx.body_pose")).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((Joints(clip, 25, 15) - Expected("smplifyx.left")).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((Joints(clip, 40, 15) - Expected("smplifyx.right")).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_NEAR(clip.betas(0), 0.1, 1e-6);  // of 0, 0.1 and 0.2
  EXPECT_TRUE(Mentions(imported.notes, "betas differ"));
  EXPECT_TRUE(Mentions(imported.notes, "-y was taken"));
  EXPECT_TRUE(Mentions(imported.dropped, "camera_translation"));
}

TEST(ImportParameters, CoefficientsWithoutTheMeanWhereTheUserSaysSo) {
  ImportFileOptions options = WithHandModel();
  options.parameters.flat_hand_mean = true;
  const Clip flat = Import(Fixture("parameters/smplifyx"), options).clip;
  const Clip mean = Import(Fixture("parameters/smplifyx"), WithHandModel()).clip;
  const Eigen::MatrixXd difference = Joints(mean, 40, 15) - Joints(flat, 40, 15);
  for (int i = 0; i < 45; ++i) EXPECT_NEAR(difference(i, 1), 0.3 - 0.6 * i / 44, 1e-6);
}

TEST(ImportParameters, FingersCanBeLeftOut) {
  ImportFileOptions options;
  options.parameters.hands = ImportedHands::kNone;
  const ImportedFile imported = Import(Fixture("parameters/smplifyx"), options);
  const auto mean = BodyModel::Default()->HandMean(Side::kRight);
  EXPECT_LT((Joints(imported.clip, 40, 15).col(2) - mean).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ImportParameters, VposersLatentIsRefused) {
  try {
    Import(Fixture("parameters/vposer.pkl"), WithHandModel());
    FAIL() << "32 numbers taken for a pose";
  } catch (const Error& error) {
    EXPECT_THAT(error.Where(), HasSubstr("body_pose"));
    EXPECT_THAT(error.Problem(), HasSubstr("VPoser"));
    EXPECT_THAT(error.Remedy(), HasSubstr("(1, 63)"));
  }
}

TEST(ImportParameters, SmplerXIsAFileAFrameAndPerson) {
  const ImportedFile imported = Import(Fixture("parameters/smplerx"), Flat());
  ASSERT_EQ(imported.clip.NumFrames(), 3);
  EXPECT_LT((Joints(imported.clip, 1, 21) - Expected("smplerx.body_pose")).cwiseAbs().maxCoeff(),
            1e-7);
  EXPECT_TRUE(Mentions(imported.notes, "2 people"));
  EXPECT_TRUE(Mentions(imported.notes, "last number: 1;"));
  ImportFileOptions second = Flat();
  second.parameters.person = 1;
  EXPECT_EQ(Import(Fixture("parameters/smplerx"), second).clip.NumFrames(), 2);
  second.parameters.person = 2;
  EXPECT_THROW(Import(Fixture("parameters/smplerx"), second), Error);
}

TEST(ImportParameters, MatricesAreTheSamePosesAndTakeNoMeanHand) {
  const ImportedFile imported = Import(Fixture("parameters/rotation_matrices.npz"), Flat(false));
  const Clip& clip = imported.clip;
  EXPECT_EQ(clip.frame_rate, 25);
  ASSERT_EQ(clip.NumFrames(), 6);
  EXPECT_LT(LargestTurn(Joints(clip, 0, 1), Expected("matrices.global_orient")), 1e-5);
  EXPECT_LT(LargestTurn(Joints(clip, 1, 21), Expected("matrices.body_pose")), 1e-5);
  EXPECT_LT(LargestTurn(Joints(clip, 25, 15), Expected("matrices.left_hand_pose")), 1e-5);
  EXPECT_LT(LargestTurn(Joints(clip, 40, 15), Expected("matrices.right_hand_pose")), 1e-5);
  EXPECT_EQ(imported.body_defects.bad, 0);
  // One frame, with (PIXIE) and without (ExPose) a batch of one.
  for (const char* name : {"parameters/expose.npz", "parameters/pixie_param.pkl"}) {
    const Clip one = Import(Fixture(name), Flat()).clip;
    ASSERT_EQ(one.NumFrames(), 1) << name;
    EXPECT_LT(LargestTurn(Joints(one, 1, 21), Joints(clip, 1, 21).leftCols(1)), 1e-6) << name;
    EXPECT_LT(LargestTurn(Joints(one, 40, 15), Joints(clip, 40, 15).leftCols(1)), 1e-6) << name;
  }
}

TEST(ImportParameters, JsonAndListsOfFramesAreTheSame) {
  const Clip json = Import(Fixture("parameters/smplx.json"), Flat()).clip;
  const Clip list = Import(Fixture("parameters/list_of_frames.pkl"), Flat()).clip;
  ASSERT_EQ(json.NumFrames(), 6);
  ASSERT_EQ(list.NumFrames(), 6);
  EXPECT_LT((json.trans - Expected("plain.transl")).cwiseAbs().maxCoeff(), 1e-6);
  for (const Clip& clip : {json, list}) {
    EXPECT_LT((Joints(clip, 0, 1) - Expected("plain.global_orient")).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((Joints(clip, 1, 21) - Expected("plain.body_pose")).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((Joints(clip, 40, 15) - Expected("plain.right_hand_pose")).cwiseAbs().maxCoeff(),
              1e-6);
  }
}

TEST(ImportParameters, MotionXIsTurnedToZUpAboutThePelvis) {
  const ImportedFile imported = Import(Fixture("parameters/motion_x.npy"));
  const Eigen::MatrixXd rows = Expected("motion_x.rows");
  EXPECT_EQ(imported.format, "Motion-X");
  EXPECT_EQ(imported.clip.frame_rate, 30);
  // Every joint of the body goes where the world's turn takes it.
  const auto body = BodyModel::Default();
  const Eigen::Matrix3Xd rest = body->RestJoints(body->Template());
  Eigen::Matrix3d z_up;
  z_up << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  for (Eigen::Index t = 0; t < rows.cols(); ++t) {
    JointPose pose = JointPose::Zero();
    pose.leftCols<22>() = rows.col(t).head<66>().reshaped(3, 22);
    pose.rightCols<30>() = rows.col(t).segment<90>(66).reshaped(3, 30);
    pose.col(22) = rows.col(t).segment<3>(156);
    BodyState theirs, ours;
    ForwardJoints(rest, pose, rows.col(t).segment<3>(309), theirs);
    ForwardJoints(rest, imported.clip.pose[t], imported.clip.trans.col(t), ours);
    EXPECT_LT((ours.joints - z_up * theirs.joints).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(ImportParameters, FeaturesAreRefusedByName) {
  try {
    Import(Fixture("parameters/humanml3d.npy"));
    FAIL() << "features taken for poses";
  } catch (const Error& error) {
    EXPECT_THAT(error.Problem(), HasSubstr("HumanML3D"));
  }
}

// --- ARCTIC ---

const char kArctic[] = "parameters/arctic/data/arctic_data/data/raw_seqs/s01/box_grab_01.smplx.npy";

TEST(ImportArctic, ObjectIsForColumnsAndCameInMillimetres) {
  const ImportedFile imported = Import(Fixture(kArctic));
  const Clip& clip = imported.clip;
  ASSERT_TRUE(clip.object);
  EXPECT_LT((Posed(Expected("arctic.cube"), *clip.object) - Expected("arctic.object"))
                .cwiseAbs()
                .maxCoeff(),
            2e-6);
  EXPECT_LT((Joints(clip, 0, kNumJoints) - Expected("arctic.fullpose")).cwiseAbs().maxCoeff(),
            1e-6);
  EXPECT_EQ(clip.subject, "s01");
  EXPECT_EQ(clip.action, "grab");
  EXPECT_EQ(clip.gender, "female");
  EXPECT_EQ(clip.object->name, "box");
  EXPECT_EQ(imported.object_mesh_scale, 1e-3);
  EXPECT_NEAR(ReadMesh(imported.object_mesh).vertices.row(0).maxCoeff(), 30, 1e-3);
  EXPECT_TRUE(Mentions(imported.dropped, "articulation"));
}

TEST(ImportArctic, ManoHandsTakeTheirMeanHand) {
  std::string mano = kArctic;
  mano.replace(mano.find("smplx"), 5, "mano");
  ImportFileOptions options;
  EXPECT_THROW(Import(Fixture(mano), options), Error);  // which hand?
  options.parameters.hands = ImportedHands::kRightAlone;
  options.parameters.hand_models = {Fixture("parameters/MANO_RIGHT.pkl")};
  const ImportedFile imported = Import(Fixture(mano), options);
  EXPECT_EQ(imported.clip.surface_model_type, "mano");
  EXPECT_LT((Joints(imported.clip, 40, 15) - Expected("arctic.mano_right")).cwiseAbs().maxCoeff(),
            1e-6);
}

TEST(ImportArctic, AnObjectOfAnotherLengthIsRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path from = Fixture(kArctic);
  std::filesystem::copy(from, folder / "box_grab_01.smplx.npy");
  // The first row only: 128 bytes of header, 7 floats.
  std::ifstream in(from.parent_path() / "box_grab_01.object.npy", std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const std::size_t shape = bytes.find("(6, 7)");
  ASSERT_NE(shape, std::string::npos);
  bytes[shape + 1] = '5';
  bytes.resize(bytes.size() - 7 * 4);
  std::ofstream(folder / "box_grab_01.object.npy", std::ios::binary) << bytes;
  try {
    Import(folder / "box_grab_01.smplx.npy");
    FAIL() << "5 frames of an object for 6 of a body";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("5 frames"));
    EXPECT_THAT(error.what(), HasSubstr("object.npy"));
  }
}

// --- the world ---

TEST(ImportWorld, EveryAxisTurnsToZAndKeepsTheBodyWhole) {
  const auto body = BodyModel::Default();
  const Eigen::Matrix3Xd rest = body->RestJoints(body->Template());
  for (const char* name : {"x", "-x", "y", "-y", "z", "-z"}) {
    const WorldUp up = *ParseWorldUp(name);
    EXPECT_EQ(WorldUpName(up), name);
    const Eigen::Matrix3d Q = ZUpFrom(up);
    const int axis = static_cast<int>(up) / 2;
    const double sign = name[0] == '-' ? -1 : 1;
    EXPECT_EQ(Q * (sign * Eigen::Vector3d::Unit(axis)), Eigen::Vector3d::UnitZ()) << name;
    EXPECT_EQ(Q.determinant(), 1) << name;
    Clip clip;
    clip.pose.assign(1, JointPose::Random());
    clip.trans = Eigen::Vector3d::Random();
    clip.object = ObjectTrack{Eigen::Vector3d::Random(), Eigen::Vector3d::Random(), "", ""};
    BodyState before, after;
    ForwardJoints(rest, clip.pose[0], clip.trans.col(0), before);
    const Eigen::MatrixXd object = Posed(Eigen::Matrix3d::Identity(), *clip.object);
    TurnWorld(clip, Q, PelvisOf(clip, *body));
    ForwardJoints(rest, clip.pose[0], clip.trans.col(0), after);
    EXPECT_LT((after.joints - Q * before.joints).cwiseAbs().maxCoeff(), 1e-12) << name;
    EXPECT_LT((Posed(Eigen::Matrix3d::Identity(), *clip.object) - Q * object).cwiseAbs().maxCoeff(),
              1e-12);
  }
  EXPECT_FALSE(ParseWorldUp("up"));
}

// About the pelvis of the model that a file is made with, where that is another than the body.
TEST(ImportWorld, TurnsAboutThePelvisOfTheFilesOwnModel) {
  const auto body = BodyModel::Default();
  Clip clip;
  EXPECT_LT((PelvisOf(clip, *body) - Eigen::Vector3d(0.0031, -0.3514, 0.0120)).norm(), 1e-6);
  for (const char* type : {"smplh", "smpl"}) {
    clip.surface_model_type = type;
    EXPECT_EQ(PelvisOf(clip, *body), Eigen::Vector3d(-0.0018, -0.2233, 0.0282)) << type;
  }
}

}  // namespace
}  // namespace holdfast::testing
