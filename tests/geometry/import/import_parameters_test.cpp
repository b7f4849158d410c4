// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/import/amass.h"
#include "geometry/import/load_clip.h"
#include "geometry/import/world_frame.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/support/imported.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::testing {
namespace {

using ::testing::AllOf;
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
    EXPECT_LT(MaxDifference(Joints(imported->clip, 0, kNumJoints), expected), 1e-7);
    EXPECT_LT(MaxDifference(imported->clip.trans, Expected("amass.trans")), 1e-7);
    EXPECT_LT(MaxDifference(imported->clip.betas, Expected("amass.betas")), 1e-7);
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
  EXPECT_LT(MaxDifference(Joints(clip, 0, 22), expected.topRows(66)), 1e-7);
  EXPECT_TRUE(Joints(clip, 22, 3).isZero(0.0));
  EXPECT_LT(MaxDifference(Joints(clip, 25, 30), expected.bottomRows(90)), 1e-7);
  EXPECT_TRUE(Mentions(imported.dropped, "dmpls"));
}

// --- fitting codes ---

TEST(ImportParameters, SmplifyXIsAFolderAFrameInNaturalOrder) {
  const ImportedFile imported = Import(Fixture("parameters/smplifyx"), WithHandModel());
  const Clip& clip = imported.clip;
  ASSERT_EQ(clip.NumFrames(), 3);
  EXPECT_LT(MaxDifference(Joints(clip, 1, 21), Expected("smplifyx.body_pose")), 1e-6);
  EXPECT_LT(MaxDifference(Joints(clip, 25, 15), Expected("smplifyx.left")), 1e-6);
  EXPECT_LT(MaxDifference(Joints(clip, 40, 15), Expected("smplifyx.right")), 1e-6);
  EXPECT_NEAR(clip.betas(0), 0.1, 1e-6);  // of 0, 0.1 and 0.2
  EXPECT_TRUE(Mentions(imported.notes, "betas differ"));
  EXPECT_TRUE(Mentions(imported.notes, "-y is used"));
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
  EXPECT_LT(MaxDifference(Joints(imported.clip, 40, 15).col(2), mean), 1e-12);
}

TEST(ImportParameters, VposersLatentIsRefused) {
  EXPECT_THAT(ImportFault(Fixture("parameters/vposer.pkl"), WithHandModel()),
              AllOf(HasSubstr("body_pose"), HasSubstr("VPoser"), HasSubstr("(1, 63)")));
}

TEST(ImportParameters, SmplerXIsAFileAFrameAndPerson) {
  const ImportedFile imported = Import(Fixture("parameters/smplerx"), Flat());
  ASSERT_EQ(imported.clip.NumFrames(), 3);
  EXPECT_LT(MaxDifference(Joints(imported.clip, 1, 21), Expected("smplerx.body_pose")), 1e-7);
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
  EXPECT_LT(MaxDifference(json.trans, Expected("plain.transl")), 1e-6);
  for (const Clip& clip : {json, list}) {
    EXPECT_LT(MaxDifference(Joints(clip, 0, 1), Expected("plain.global_orient")), 1e-6);
    EXPECT_LT(MaxDifference(Joints(clip, 1, 21), Expected("plain.body_pose")), 1e-6);
    EXPECT_LT(MaxDifference(Joints(clip, 40, 15), Expected("plain.right_hand_pose")), 1e-6);
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
    EXPECT_LT(MaxDifference(ours.joints, z_up * theirs.joints), 1e-6);
  }
}

TEST(ImportParameters, FeaturesAreRefusedByName) {
  EXPECT_THAT(ImportFault(Fixture("parameters/humanml3d.npy")), HasSubstr("HumanML3D"));
}

// --- ARCTIC ---

const char kArctic[] = "parameters/arctic/data/arctic_data/data/raw_seqs/s01/box_grab_01.smplx.npy";

TEST(ImportArctic, ObjectIsForColumnsAndCameInMillimeters) {
  const ImportedFile imported = Import(Fixture(kArctic));
  const Clip& clip = imported.clip;
  ASSERT_TRUE(clip.object);
  EXPECT_LT(MaxDifference(Posed(Expected("arctic.cube"), *clip.object), Expected("arctic.object")),
            2e-6);
  EXPECT_LT(MaxDifference(Joints(clip, 0, kNumJoints), Expected("arctic.fullpose")), 1e-6);
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
  EXPECT_LT(MaxDifference(Joints(imported.clip, 40, 15), Expected("arctic.mano_right")), 1e-6);
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
  EXPECT_THAT(ImportFault(folder / "box_grab_01.smplx.npy"),
              AllOf(HasSubstr("5 frames"), HasSubstr("object.npy")));
}

// --- forms of rotations ---

// How a file has rotations.
struct Form {
  const char* shape;
  int rows, columns;                   // of each matrix that are there; none: axis-angle
  std::vector<std::size_t> per_joint;  // dimensions behind the joints'; none: all in one
};
const Form kFlat{"(T, 3J)", 0, 0, {}};
const Form kSixDOfColumns{"(T, J, 6), two columns in rows of two", 3, 2, {6}};
const Form kSixDOfRows{"(T, 6J), the first two rows", 2, 3, {}};
const Form kWholeMatrices{"(T, J, 3, 3)", 3, 3, {3, 3}};
const Form kForms[] = {kFlat,
                       {"(T, J, 3)", 0, 0, {3}},
                       kWholeMatrices,
                       {"(T, J, 9)", 3, 3, {9}},
                       {"(T, 9J)", 3, 3, {}},
                       {"(T, J, 3, 2)", 3, 2, {3, 2}},
                       {"(T, J, 2, 3)", 2, 3, {2, 3}},
                       kSixDOfColumns,
                       kSixDOfRows};

// Axis-angle (3J x T) as an array of a file.
void AddRotations(const std::string& name, const Eigen::MatrixXd& angles, const Form& form,
                  NpzWriter& writer, bool without_frames = false) {
  const auto frames = static_cast<std::size_t>(angles.cols());
  const auto joints = static_cast<std::size_t>(angles.rows() / 3);
  std::vector<double> values;
  for (Eigen::Index t = 0; t < angles.cols(); ++t) {
    for (Eigen::Index j = 0; j < angles.rows() / 3; ++j) {
      const Eigen::Vector3d w = angles.col(t).segment<3>(3 * j);
      if (form.rows == 0) values.insert(values.end(), w.begin(), w.end());
      const Eigen::Matrix3d R = ExpSO3(w);
      for (int row = 0; row < form.rows; ++row) {
        for (int column = 0; column < form.columns; ++column) values.push_back(R(row, column));
      }
    }
  }
  std::vector<std::size_t> shape;
  if (!without_frames) shape.push_back(frames);
  if (form.per_joint.empty()) {
    shape.push_back(values.size() / frames);
  } else {
    shape.push_back(joints);
    shape.insert(shape.end(), form.per_joint.begin(), form.per_joint.end());
  }
  writer.AddFloat64(name, shape, values);
}

void AddRows(const char* name, const Eigen::MatrixXd& columns, NpzWriter& writer) {
  writer.AddFloat64(
      name, {static_cast<std::size_t>(columns.cols()), static_cast<std::size_t>(columns.rows())},
      {columns.data(), columns.data() + columns.size()});
}

Clip EmbeddedClip() {
  const EmbeddedFile file = FindEmbedded("clips/demo_drink.npz");
  return Slice(ReadClip(NpzReader(file.bytes, "demo_drink")), 40, 47);
}

struct BodyField {
  const char* name;
  int begin, joints;
};
constexpr BodyField kBodyFields[] = {{"global_orient", 0, 1},    {"body_pose", 1, 21},
                                     {"jaw_pose", 22, 1},        {"leye_pose", 23, 1},
                                     {"reye_pose", 24, 1},       {"left_hand_pose", 25, 15},
                                     {"right_hand_pose", 40, 15}};

TEST(ImportRotations, EveryFieldOfABodyComesInEveryForm) {
  const TemporaryFolder folder;
  Clip clip = EmbeddedClip();
  for (JointPose& pose : clip.pose) pose.middleCols<3>(22).setConstant(0.1);
  for (const Form& form : kForms) {
    // This form in one field, axis-angle in all others; then in all of them.
    for (int only = -1; only < 7; ++only) {
      NpzWriter writer;
      writer.AddFloat64("fps", {}, {30});
      AddRows("transl", clip.trans, writer);
      for (int k = 0; k < 7; ++k) {
        const BodyField& field = kBodyFields[k];
        AddRotations(field.name, Joints(clip, field.begin, field.joints),
                     only < 0 || only == k ? form : kFlat, writer);
      }
      writer.Write(folder / "p.npz");
      ImportFileOptions options = Flat();
      options.parameters.up = UpAxis::kZ;
      const ImportedFile imported = Import(folder / "p.npz", options);
      ASSERT_EQ(imported.clip.NumFrames(), clip.NumFrames());
      EXPECT_LT(LargestTurn(Joints(imported.clip, 0, kNumJoints), Joints(clip, 0, kNumJoints)),
                1e-7)
          << form.shape << ", field " << only;
      EXPECT_EQ(Mentions(imported.notes, "warning: 6D rotations are taken"), form.rows == 2);
    }
  }
}

// A quarter turn about x, which stands a body up, is orthonormal in both readings of 6D.
TEST(ImportRotations, TheBodyTellsHowTheRootsSixNumbersAreMeant) {
  const TemporaryFolder folder;
  Clip clip = EmbeddedClip();
  for (JointPose& pose : clip.pose) pose.col(0) = Eigen::Vector3d(std::numbers::pi / 2, 0, 0);
  for (const Form& form : {kSixDOfColumns, kSixDOfRows, kFlat}) {
    NpzWriter parameters, amass;
    AddRows("transl", clip.trans, parameters);
    AddRows("trans", clip.trans, amass);
    const bool ambiguous = form.rows == 0;
    const Form& of_root = ambiguous ? kSixDOfRows : form;
    AddRotations("global_orient", Joints(clip, 0, 1), of_root, parameters);
    AddRotations("root_orient", Joints(clip, 0, 1), of_root, amass);
    AddRotations("body_pose", Joints(clip, 1, 21), form, parameters);
    AddRotations("pose_body", Joints(clip, 1, 21), form, amass);
    parameters.Write(folder / "parameters.npz");
    amass.Write(folder / "amass.npz");
    for (const char* name : {"parameters.npz", "amass.npz"}) {
      if (ambiguous) {
        EXPECT_THAT(ImportFault(folder / name), HasSubstr("orthonormal both ways")) << name;
        continue;
      }
      ImportFileOptions options;
      options.parameters.up = UpAxis::kZ;
      const Clip read = Import(folder / name, options).clip;
      EXPECT_LT(LargestTurn(Joints(read, 0, 22), Joints(clip, 0, 22)), 1e-7) << name;
    }
  }
}

TEST(ImportRotations, OneFrameNeedsNoDimensionOfFrames) {
  const TemporaryFolder folder;
  const Clip clip = Slice(EmbeddedClip(), 0, 1);
  for (const Form& form : kForms) {
    SCOPED_TRACE(form.shape);
    NpzWriter writer;
    writer.AddFloat64("transl", {3}, {clip.trans(0), clip.trans(1), clip.trans(2)});
    for (const BodyField& field : kBodyFields) {
      AddRotations(field.name, Joints(clip, field.begin, field.joints), form, writer, true);
    }
    writer.Write(folder / "p.npz");
    ImportFileOptions options = Flat();
    options.parameters.up = UpAxis::kZ;
    const Clip one = Import(folder / "p.npz", options).clip;
    ASSERT_EQ(one.NumFrames(), 1);
    EXPECT_LT(LargestTurn(Joints(one, 0, kNumJoints), Joints(clip, 0, kNumJoints)), 1e-7);
  }
}

TEST(ImportRotations, AmassAndClipsComeInEveryFormWithTheirObject) {
  const TemporaryFolder folder;
  Clip clip = EmbeddedClip();
  ObjectTrack& track = clip.object.emplace();
  track.trans = clip.trans;
  track.orient = Joints(clip, 21, 1);
  for (const Form& form : kForms) {
    NpzWriter joined, parts;
    for (NpzWriter* writer : {&joined, &parts}) {
      writer->AddFloat64("mocap_frame_rate", {}, {120});
      AddRows("trans", clip.trans, *writer);
      AddRows("object_trans", track.trans, *writer);
      AddRotations("object_orient", track.orient, form, *writer);
    }
    AddRotations("poses", Joints(clip, 0, kNumJoints), form, joined);
    AddRotations("root_orient", Joints(clip, 0, 1), form, parts);
    AddRotations("pose_body", Joints(clip, 1, 21), form, parts);
    AddRotations("pose_eye", Joints(clip, 23, 2), form, parts);
    AddRotations("pose_hand", Joints(clip, 25, 30), form, parts);
    joined.Write(folder / "joined.npz");
    parts.Write(folder / "parts.npz");
    for (const char* name : {"joined.npz", "parts.npz"}) {
      SCOPED_TRACE(std::string(name) + " " + form.shape);
      const Clip loaded = LoadClip((folder / name).string()).clip;
      ASSERT_EQ(loaded.NumFrames(), clip.NumFrames());
      EXPECT_EQ(loaded.frame_rate, 120);
      EXPECT_LT(LargestTurn(Joints(loaded, 0, 22), Joints(clip, 0, 22)), 1e-7);
      EXPECT_LT(LargestTurn(Joints(loaded, 25, 30), Joints(clip, 25, 30)), 1e-7);
      ASSERT_TRUE(loaded.object);
      EXPECT_LT(LargestTurn(loaded.object->orient, track.orient), 1e-7);
    }
  }
}

// HaMeR's layout, and each field in another form: none of it ends in a division by zero.
TEST(ImportRotations, AHandAloneComesInEveryForm) {
  const TemporaryFolder folder;
  const Clip clip = EmbeddedClip();
  const Eigen::MatrixXd root = Joints(clip, 0, 1), fingers = Joints(clip, 40, 15);
  for (const Form& of_root : kForms) {
    for (const Form& of_fingers : kForms) {
      NpzWriter writer;
      AddRows("transl", clip.trans, writer);
      AddRotations("global_orient", root, of_root, writer);
      AddRotations("hand_pose", fingers, of_fingers, writer);
      writer.AddFloat64("betas", {7, 10}, std::vector<double>(70, 0.5));
      writer.Write(folder / "hand.npz");
      const ImportedFile imported = Import(folder / "hand.npz", Flat());
      ASSERT_EQ(imported.clip.NumFrames(), 7);
      EXPECT_LT(LargestTurn(Joints(imported.clip, 0, 1), root), 1e-7);
      EXPECT_LT(LargestTurn(Joints(imported.clip, 40, 15), fingers), 1e-7)
          << of_root.shape << " " << of_fingers.shape;
      EXPECT_EQ(imported.clip.betas, Eigen::VectorXd::Constant(10, 0.5));
    }
  }
}

TEST(ImportRotations, TheOtherFieldsTellWhatAShapeIs) {
  const TemporaryFolder folder;
  const auto write = [&](std::size_t frames, std::vector<std::size_t> shape, double value) {
    NpzWriter writer;
    writer.AddFloat64("transl", {frames, 3}, std::vector<double>(3 * frames, 0.1));
    writer.AddFloat64("global_orient", {frames, 3}, std::vector<double>(3 * frames, 0.1));
    std::size_t size = 1;
    for (const std::size_t n : shape) size *= n;
    writer.AddFloat64("hand_pose", std::move(shape), std::vector<double>(size, value));
    writer.Write(folder / "hand.npz");
    return folder / "hand.npz";
  };
  // 15 frames of 6 coefficients, or one frame of 15 joints in 6D.
  EXPECT_THAT(ImportFault(write(15, {15, 6}, 0.1)), HasSubstr("6 coefficients"));
  EXPECT_THAT(ImportFault(write(1, {15, 6}, 0.1)), HasSubstr("6D"));
  EXPECT_THAT(ImportFault(write(15, {15, 9}, 0.1)), HasSubstr("9 coefficients"));
  EXPECT_THAT(ImportFault(write(1, {15, 9}, 0.1)), HasSubstr("not a rotation"));
  // 23 frames are not SMPL's 23 joints.
  NpzWriter body;
  for (const auto& [name, n] :
       {std::pair{"transl", 3U}, {"global_orient", 3U}, {"body_pose", 63U}}) {
    body.AddFloat64(name, {23, n}, std::vector<double>(23 * n, 0.1));
  }
  body.Write(folder / "body.npz");
  EXPECT_EQ(Import(folder / "body.npz").clip.surface_model_type, "smplx");
}

TEST(ImportRotations, MatricesFarFromRotationsAreFaultsAndNearOnesAreWarnedOf) {
  const TemporaryFolder folder;
  const Clip clip = EmbeddedClip();
  const auto write = [&](double scale) {
    NpzWriter writer;
    AddRows("transl", clip.trans, writer);
    AddRotations("global_orient", Joints(clip, 0, 1), kWholeMatrices, writer);
    std::vector<double> matrices;
    for (int t = 0; t < 7; ++t) {
      for (int j = 0; j < 15; ++j) {
        const Eigen::Matrix3d R =
            (t == 3 && j == 4 ? scale : 1.0) * ExpSO3(clip.pose[0].col(40 + j));
        for (int i = 0; i < 9; ++i) matrices.push_back(R(i / 3, i % 3));
      }
    }
    writer.AddFloat64("hand_pose", {7, 15, 3, 3}, matrices);
    writer.Write(folder / "hand.npz");
    return folder / "hand.npz";
  };
  for (const double scale : {0.0, 3.0, -1.0}) {
    EXPECT_THAT(ImportFault(write(scale), Flat()),
                AllOf(HasSubstr("hand_pose"), HasSubstr("frame 3, joint 4")))
        << scale;
  }
  const ImportedFile near = Import(write(1.02), Flat());
  EXPECT_TRUE(Mentions(near.notes, "warning: the body: 1 of 112 matrices"));
  EXPECT_LT(LargestTurn(Joints(near.clip, 40, 15).col(3), Joints(clip, 40, 15).col(0)), 1e-7);
}

// --- betas ---

TEST(ImportBetas, OneAFrameIsOnePerson) {
  const TemporaryFolder folder;
  const Clip clip = EmbeddedClip();
  std::vector<double> betas;
  for (int t = 0; t < 7; ++t) {
    for (int k = 0; k < 10; ++k) betas.push_back(0.1 * k + (t == 6 ? 0.7 : 0.0));
  }
  const Eigen::VectorXd mean = Eigen::VectorXd::LinSpaced(10, 0, 0.9).array() + 0.1;
  NpzWriter amass, hand, column;
  for (NpzWriter* writer : {&amass, &hand, &column}) {
    AddRotations(writer == &amass ? "root_orient" : "global_orient", Joints(clip, 0, 1), kFlat,
                 *writer);
    AddRows(writer == &amass ? "trans" : "transl", clip.trans, *writer);
    if (writer != &amass) AddRotations("hand_pose", Joints(clip, 40, 15), kFlat, *writer);
  }
  amass.AddFloat64("mocap_frame_rate", {}, {30});
  AddRotations("pose_body", Joints(clip, 1, 21), kFlat, amass);
  amass.AddFloat64("betas", {7, 10}, betas);
  hand.AddFloat64("betas", {7, 1, 10}, betas);
  column.AddFloat64("betas", {10, 1}, {betas.begin(), betas.begin() + 10});
  amass.Write(folder / "amass.npz");
  hand.Write(folder / "hand.npz");
  column.Write(folder / "column.npz");
  const LoadedClip loaded = LoadClip((folder / "amass.npz").string());
  EXPECT_TRUE(Mentions(loaded.notes, "betas differ"));
  EXPECT_LT((Import(folder / "amass.npz").clip.betas - mean).norm(), 1e-12);
  EXPECT_THROW(ReadClip(folder / "amass.npz"), Error);  // not 70 coefficients
  const ImportedFile alone = Import(folder / "hand.npz");
  EXPECT_LT((alone.clip.betas - mean).norm(), 1e-12);
  EXPECT_TRUE(Mentions(alone.notes, "betas differ"));
  EXPECT_EQ(Import(folder / "column.npz").clip.betas.size(), 10);
}

// --- frame rates ---

TEST(ImportFrameRate, MoShKeepsItInItsDebugDetails) {
  const ImportedFile walk = Import(Fixture("cases/amass_stageii_rate/walk_stageii.pkl"));
  EXPECT_EQ(walk.clip.frame_rate, 120);
  EXPECT_EQ(walk.clip.gender, "female");
  EXPECT_EQ(walk.format, "AMASS, SMPL-X (MoSh++)");
  EXPECT_TRUE(Mentions(walk.dropped, "latent_labels"));
}

TEST(ImportFrameRate, NoneIsAWarningInEveryFormat) {
  const TemporaryFolder folder;
  const Clip clip = EmbeddedClip();
  const auto add = [&](NpzWriter& writer, const char* trans, const char* root, const char* pose,
                       const Eigen::MatrixXd& joints) {
    AddRows(trans, clip.trans, writer);
    AddRotations(root, Joints(clip, 0, 1), kFlat, writer);
    AddRotations(pose, joints, kFlat, writer);
  };
  NpzWriter parameters, amass, hand, joined;
  add(parameters, "transl", "global_orient", "body_pose", Joints(clip, 1, 21));
  add(amass, "trans", "root_orient", "pose_body", Joints(clip, 1, 21));
  add(hand, "transl", "global_orient", "hand_pose", Joints(clip, 40, 15));
  AddRows("trans", clip.trans, joined);
  AddRotations("poses", Joints(clip, 0, kNumJoints), kFlat, joined);
  int k = 0;
  for (NpzWriter* writer : {&parameters, &amass, &hand, &joined}) {
    const std::filesystem::path path = folder / ("m" + std::to_string(k++) + ".npz");
    writer->Write(path);
    const ImportedFile silent = Import(path);
    EXPECT_TRUE(Mentions(silent.notes, "warning: no frame rate in the file: assuming 30 Hz"))
        << path;
    ImportFileOptions asked;
    asked.parameters.source_frame_rate = 50;
    const ImportedFile told = Import(path, asked);
    EXPECT_EQ(told.clip.frame_rate, 50) << path;
    EXPECT_FALSE(Mentions(told.notes, "frame rate")) << path;
    writer->AddFloat64("fps", {7}, std::vector<double>(7, 25.0));  // one a frame
    writer->Write(path);
    EXPECT_EQ(Import(path).clip.frame_rate, 25) << path;
  }
}

// --- an object in a file beside ---

TEST(ImportObjectBeside, InterActsPairIsOneClip) {
  const std::filesystem::path pair = Fixture("cases/interact_pair");
  const ImportedFile imported = Import(pair / "human.npz");
  ASSERT_TRUE(imported.clip.object);
  const NpzReader object(pair / "object.npz");
  const std::vector<double> angles = object.Read("angles").AsDoubles();
  const std::vector<double> trans = object.Read("trans").AsDoubles();
  EXPECT_LT((imported.clip.object->orient.reshaped() -
             Eigen::Map<const Eigen::VectorXd>(angles.data(), 180))
                .norm(),
            1e-12);
  EXPECT_LT((imported.clip.object->trans.reshaped() -
             Eigen::Map<const Eigen::VectorXd>(trans.data(), 180))
                .norm(),
            1e-12);
  EXPECT_EQ(imported.clip.object->name, "boxsmall");
  EXPECT_TRUE(Mentions(imported.notes, "the object is read from object.npz beside it"));
  EXPECT_TRUE(LoadClip((pair / "human.npz").string()).clip.object);
  EXPECT_THAT(ImportFault(pair / "object.npz"), HasSubstr("holds object poses"));
}

TEST(ImportObjectBeside, GoesByNameElseByContent) {
  const std::filesystem::path pair = Fixture("cases/interact_pair");
  const auto copy = [&](const TemporaryFolder& folder, const char* human, const char* object) {
    std::filesystem::copy(pair / "human.npz", folder / human);
    std::filesystem::copy(pair / "object.npz", folder / object);
    return folder / human;
  };
  {
    const TemporaryFolder folder;  // BEHAVE's names, and a mesh as InterAct has it
    std::filesystem::create_directories(folder / "objects/boxsmall");
    std::ofstream(folder / "objects/boxsmall/boxsmall.obj")
        << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const ImportedFile found = Import(copy(folder, "smpl_fit_all.npz", "object_fit_all.npz"));
    EXPECT_TRUE(found.clip.object);
    EXPECT_EQ(found.object_mesh.filename(), "boxsmall.obj");
  }
  {
    const TemporaryFolder folder;  // no names that belong together, but nothing else is there
    EXPECT_TRUE(Import(copy(folder, "seq.npz", "box.npz")).clip.object);
  }
  {
    const TemporaryFolder folder;  // of another sequence
    const std::filesystem::path human = copy(folder, "human.npz", "x.npz");
    NpzWriter object;
    object.AddFloat64("angles", {59, 3}, std::vector<double>(177, 0.1));
    object.AddFloat64("trans", {59, 3}, std::vector<double>(177, 0.1));
    object.Write(folder / "object.npz");
    const ImportedFile other = Import(human);
    EXPECT_FALSE(other.clip.object);
    EXPECT_TRUE(Mentions(other.notes, "warning: the object in object.npz beside it is not used"));
  }
  {
    const TemporaryFolder folder;  // which?
    const std::filesystem::path human = copy(folder, "human.npz", "object.npz");
    std::filesystem::copy(pair / "object.npz", folder / "obj.npz");
    const ImportedFile both = Import(human);
    EXPECT_FALSE(both.clip.object);
    EXPECT_TRUE(Mentions(both.notes, "warning: several files"));
  }
  {
    const TemporaryFolder folder;  // a person's motion is no object
    std::filesystem::copy(pair / "human.npz", folder / "human.npz");
    std::filesystem::copy(pair / "human.npz", folder / "object.npz");
    EXPECT_FALSE(Import(folder / "human.npz").clip.object);
  }
}

// --- angles beyond half a turn ---

TEST(WrapJointAngles, EqualRotationsAreOneClip) {
  const Clip clip = EmbeddedClip();
  Clip wound = clip;
  for (JointPose& pose : wound.pose) {
    for (int j = 25; j < kNumJoints; ++j) {
      const double angle = pose.col(j).norm();
      if (angle > 1e-3) pose.col(j) *= (angle - 2 * std::numbers::pi) / angle;
    }
  }
  ASSERT_GT(Joints(wound, 40, 15).cwiseAbs().maxCoeff(), 4);
  const TemporaryFolder folder;
  WriteClip(wound, folder / "wound.npz");
  const LoadedClip loaded = LoadClip((folder / "wound.npz").string());
  EXPECT_TRUE(Mentions(loaded.notes, "warning: joints rotate by more than half a turn in 7 of 7"));
  EXPECT_LT(MaxDifference(Joints(loaded.clip, 0, kNumJoints), Joints(clip, 0, kNumJoints)), 1e-12);
  Clip same = clip;
  EXPECT_EQ(WrapJointAngles(same), "");
  EXPECT_EQ(Joints(same, 0, kNumJoints), Joints(clip, 0, kNumJoints));

  // In the smplx package's names the fingers are judged as the rotations that they are.
  NpzWriter parameters;
  AddRows("transl", wound.trans, parameters);
  for (const BodyField& field : kBodyFields) {
    AddRotations(field.name, Joints(wound, field.begin, field.joints), kFlat, parameters);
  }
  parameters.Write(folder / "p.npz");
  ImportFileOptions options;
  options.parameters.up = UpAxis::kZ;
  const ImportedFile imported = Import(folder / "p.npz", options);
  EXPECT_LT(MaxDifference(Joints(imported.clip, 25, 30), Joints(clip, 25, 30)), 1e-12);
}

// --- the world ---

TEST(ImportWorld, EveryAxisTurnsToZAndKeepsTheBodyWhole) {
  const auto body = BodyModel::Default();
  const Eigen::Matrix3Xd rest = body->RestJoints(body->Template());
  for (const auto& [up, name] : {std::pair{UpAxis::kX, "x"}, std::pair{UpAxis::kMinusX, "-x"},
                                 std::pair{UpAxis::kY, "y"}, std::pair{UpAxis::kMinusY, "-y"},
                                 std::pair{UpAxis::kZ, "z"}, std::pair{UpAxis::kMinusZ, "-z"}}) {
    EXPECT_EQ(UpAxisName(up), name);
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
    EXPECT_LT(MaxDifference(after.joints, Q * before.joints), 1e-12) << name;
    EXPECT_LT(MaxDifference(Posed(Eigen::Matrix3d::Identity(), *clip.object), Q * object), 1e-12);
  }
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
