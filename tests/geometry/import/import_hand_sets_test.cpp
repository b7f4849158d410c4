// SPDX-License-Identifier: MIT
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/body/default_hand.h"
#include "geometry/body/hand_model.h"
#include "geometry/clip/clip_body.h"
#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/io/pickle/data_file.h"
#include "tests/support/imported.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::testing {
namespace {

using ::testing::HasSubstr;

// Of make_hand_sets.py: a column for each frame.
Eigen::MatrixXd ExpectedOfSet(const std::string& name) {
  const NpyMember member = NpzReader(Fixture("hand_sets/expected.npz")).Read(name);
  const std::vector<double> values = member.AsDoubles();
  const auto rows = static_cast<Eigen::Index>(member.array.shape.back());
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), rows,
                                           static_cast<Eigen::Index>(values.size()) / rows);
}

ImportFileOptions Of(ImportedHands hands) {
  ImportFileOptions options;
  options.parameters.hands = hands;
  return options;
}

// Root joint, its rotation (row-major), fingers and object of every frame against the numbers of
// the script.
void ExpectSet(const std::string& name, const Clip& clip, Side side) {
  SCOPED_TRACE(name);
  const BodySurface hand(DefaultHand(side));
  const Eigen::MatrixXd wrist = ExpectedOfSet(name + ".wrist"),
                        root = ExpectedOfSet(name + ".root");
  ASSERT_EQ(clip.NumFrames(), wrist.cols());
  EXPECT_TRUE(IsHandAlone(clip));
  EXPECT_EQ(SideOfHandAlone(clip), side);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const Eigen::Vector3d place = hand.RestJoints().col(0) + clip.trans.col(t);
    EXPECT_LT((place - wrist.col(t)).norm(), 1e-6) << t;
    const Eigen::Matrix3d turn = ExpSO3(clip.pose[t].col(0));
    EXPECT_LT((turn.transpose().reshaped() - root.col(t)).norm(), 1e-6) << t;
  }
  EXPECT_LT(MaxDifference(Joints(clip, HandBegin(side), 15), ExpectedOfSet(name + ".fingers")),
            1e-6);
  if (!clip.object) return;
  const Eigen::MatrixXd posed = Posed(ExpectedOfSet("cube"), *clip.object);
  EXPECT_LT(MaxDifference(posed.reshaped(24, clip.NumFrames()), ExpectedOfSet(name + ".object")),
            1e-6);
}

TEST(ImportHandSets, Ho3dIsAFolderOfFramesInOpenGlsCamera) {
  const ImportedFile imported = Import(Fixture("hand_sets/ho3d/meta"));
  ExpectSet("ho3d", imported.clip, Side::kRight);
  EXPECT_EQ(imported.clip.object->name, "025_mug");
  EXPECT_TRUE(Mentions(imported.notes, "no hand in 1 of 4 frames (2)"));
  EXPECT_TRUE(Mentions(imported.notes, "mesh of the object '025_mug' was not found"));
}

TEST(ImportHandSets, ADictThatHoldsItselfIsRefused) {
  const TemporaryFolder folder;
  const auto write = [&](const char* name, const std::string& hand, const std::string& itself) {
    // {hand: {"handPose": None, "handTrans": None}, itself: the dict}
    const auto text = [](const std::string& word) {
      return "U" + std::string(1, static_cast<char>(word.size())) + word;
    };
    std::ofstream(folder / name, std::ios::binary)
        << "\x80\x02}q" << '\0' << "(" << text(hand) << "}(" << text("handPose") << "N"
        << text("handTrans") << "Nu" << text(itself) << "h" << '\0' << "u.";
  };
  write("frames.pkl", "1", "2");
  EXPECT_THAT(ImportFault(folder / "frames.pkl"), HasSubstr("holds no hand in the form"));
  write("sides.pkl", "right", "left");
  EXPECT_THAT(ImportFault(folder / "sides.pkl", Of(ImportedHands::kLeftAlone)),
              HasSubstr("holds no hand in the form"));
}

TEST(ImportHandSets, NamesThatGarbleATerminalAreDropped) {
  const TemporaryFolder folder;
  std::string pose = "0";
  for (int k = 1; k < 48; ++k) pose += ", 0.1";
  std::ofstream(folder / "one.json")
      << R"({"handPose": [)" << pose << R"(], "handTrans": [0, 0, 0], "objRot": [0, 0, 0],)"
      << R"( "objTrans": [0, 0, 0], "objName": "\u001b[31mred"})";
  EXPECT_EQ(Import(folder / "one.json").clip.object->name, "object");
}

TEST(ImportHandSets, DexYcbHoldsTheObjectThatItsMetaNames) {
  ImportFileOptions options;
  const std::filesystem::path folder = Fixture("hand_sets/dexycb/841412060263");
  EXPECT_THAT(ImportFault(folder), HasSubstr("--hand-model"));
  options.parameters.hand_models = {Fixture("parameters/MANO_RIGHT.pkl")};
  const ImportedFile imported = Import(folder, options);
  ExpectSet("dexycb", imported.clip, Side::kRight);
  EXPECT_EQ(imported.clip.object->name, "025_mug");
  // Without the components, the hand is relaxed, and in the same place.
  const Clip relaxed = Import(folder, Of(ImportedHands::kNone)).clip;
  EXPECT_LT(MaxDifference(relaxed.trans, imported.clip.trans), 1e-9);
  EXPECT_GT(Joints(relaxed, HandBegin(Side::kRight), 15).norm(), 0.1);
}

TEST(ImportHandSets, TranslationsOfOakInkAndTacoAreOfTheWrist) {
  ExpectSet("oakink", Import(Fixture("hand_sets/oakink.pkl")).clip, Side::kRight);
  const ImportedFile taco =
      Import(Fixture("hand_sets/taco/Hand_Poses/(cut, knife, bowl)/20231027_001/left_hand.pkl"));
  ExpectSet("taco", taco.clip, Side::kLeft);
  EXPECT_EQ(taco.clip.object->name, "022");
}

TEST(ImportHandSets, Hot3dTakesTheObjectNearestToTheHand) {
  ImportFileOptions options;
  options.parameters.hand_models = {Fixture("parameters/MANO_RIGHT.pkl")};
  const ImportedFile imported =
      Import(Fixture("hand_sets/hot3d/mano_hand_pose_trajectory.jsonl"), options);
  ExpectSet("hot3d", imported.clip, Side::kRight);
  EXPECT_EQ(imported.clip.object->name, "near");
  EXPECT_EQ(imported.clip.frame_rate, 60);
  EXPECT_TRUE(Mentions(imported.notes, "no hand in 1 of 4 frames (3)"));
  const TemporaryFolder folder;
  std::ofstream(folder / "left.jsonl")
      << R"({"timestamp_ns": 1, "hand_poses": {"0": {"pose": [0.1], "wrist_xform": )"
      << R"({"q_wxyz": [1, 0, 0, 0], "t_xyz": [0, 0, 1]}}}})"
      << "\n"
      << R"({"timestamp_ns": 2, "hand_poses": {}})"
      << "\n";
  EXPECT_EQ(SideOfHandAlone(Import(folder / "left.jsonl", Of(ImportedHands::kNone)).clip),
            Side::kLeft);
  std::ofstream(folder / "umetrack.jsonl")
      << R"({"timestamp_ns": 1, "hand_poses": {"1": {"joint_angles": [0.1], "wrist_xform": {}}}})"
      << "\n"
      << R"({"timestamp_ns": 2, "hand_poses": {}})"
      << "\n";
  EXPECT_THAT(ImportFault(folder / "umetrack.jsonl"), HasSubstr("UmeTrack"));
}

TEST(ImportHandSets, ArraysWithoutNamesAreHands) {
  ImportFileOptions options;
  options.parameters.hand_models = {Fixture("parameters/MANO_RIGHT.pkl")};
  const ImportedFile hocap = Import(Fixture("hand_sets/hocap/poses_m.npy"), options);
  ExpectSet("hocap", hocap.clip, Side::kRight);
  EXPECT_TRUE(Mentions(hocap.notes, "no hand in 1 of 4 frames (3)"));
  const ImportedFile mano = Import(Fixture("hand_sets/mano_poses.npy"));
  ExpectSet("mano", mano.clip, Side::kRight);
  EXPECT_TRUE(Mentions(mano.notes, "zero is used for the translation"));
}

TEST(ImportHandSets, EasyMocapTurnsAboutTheOrigin) {
  const ImportedFile right = Import(Fixture("hand_sets/gigahands.json"));
  ExpectSet("gigahands", right.clip, Side::kRight);
  EXPECT_TRUE(Mentions(right.notes, "both hands"));
  const Clip left = Import(Fixture("hand_sets/gigahands.json"), Of(ImportedHands::kLeftAlone)).clip;
  EXPECT_EQ(SideOfHandAlone(left), Side::kLeft);

  ImportFileOptions options;
  options.parameters.up = UpAxis::kZ;
  const Clip body = Import(Fixture("hand_sets/easymocap"), options).clip;  // person 0, the second
  const Eigen::MatrixXd pelvis = ExpectedOfSet("easymocap.wrist");
  EXPECT_LT(MaxDifference(body.trans.colwise() + kSmplhRestPelvis, pelvis), 1e-6);
  options.parameters.person = 1;
  EXPECT_GT(MaxDifference(Import(Fixture("hand_sets/easymocap"), options).clip.trans, body.trans),
            0.01);
  options.parameters.person = 2;
  EXPECT_THAT(ImportFault(Fixture("hand_sets/easymocap"), options), HasSubstr("none with id 2"));
}

TEST(ImportHandSets, PicklesOfJoblibAreArrays) {
  const DataFile file(Fixture("pickle/joblib.pkl"));
  EXPECT_THAT(file["fortran"].Array().AsDoubles(), ::testing::ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(file["ids"].Array().AsIntegers(), ::testing::ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(file["again"].Array().AsIntegers(), ::testing::ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(file["half"].Array().AsDoubles(), ::testing::ElementsAre(1.5));
  EXPECT_EQ(file["empty"].Array().array.shape, (std::vector<std::size_t>{0, 3}));
  EXPECT_EQ(file["plain"][2].Text(), "text");
  EXPECT_THAT(ErrorText([] { DataFile(Fixture("pickle/joblib_objects.pkl")); }),
              HasSubstr("array of Python objects in joblib's form"));
  // Cut off anywhere, the file is refused.
  std::ifstream whole(Fixture("pickle/joblib.pkl"), std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(whole), {}};
  for (std::size_t size = 1; size < bytes.size(); size += 7) {
    const std::span part(reinterpret_cast<const std::byte*>(bytes.data()), size);
    EXPECT_THROW(DataFile(part, "part"), Error) << size;
  }
}

TEST(ImportHandSets, OmomoAndEstimatorsOfBodies) {
  ImportFileOptions options;
  options.parameters.person = 1;
  const ImportedFile omomo = Import(Fixture("hand_sets/omomo.p"), options);
  EXPECT_LT(MaxDifference(omomo.clip.trans, ExpectedOfSet("omomo.trans")), 1e-9);
  EXPECT_LT(MaxDifference(Joints(omomo.clip, 1, 21), ExpectedOfSet("omomo.pose_body")), 1e-9);
  EXPECT_EQ(omomo.clip.object->name, "largebox");
  EXPECT_EQ(omomo.object_mesh_scale, 0.5);
  const Eigen::MatrixXd cube = 0.5 * ExpectedOfSet("cube");
  EXPECT_LT(
      MaxDifference(Posed(cube, *omomo.clip.object).reshaped(24, 6), ExpectedOfSet("omomo.object")),
      1e-6);

  options = {};
  options.parameters.up = UpAxis::kZ;
  const Clip wham = Import(Fixture("hand_sets/wham.pkl"), options).clip;
  EXPECT_LT(MaxDifference(wham.trans, ExpectedOfSet("wham.trans")), 1e-9);
  EXPECT_LT(MaxDifference(Joints(wham, 0, 22), ExpectedOfSet("wham.pose")), 1e-9);
  const Clip romp = Import(Fixture("hand_sets/romp.npz"), options).clip;
  EXPECT_LT(MaxDifference(romp.trans, ExpectedOfSet("wham.trans")), 1e-9);
  EXPECT_LT(MaxDifference(Joints(romp, 0, 22), ExpectedOfSet("wham.pose")), 1e-9);
  const ImportedFile mdm = Import(Fixture("hand_sets/sample00_rep00_smpl_params.npy"), options);
  EXPECT_LT(MaxDifference(mdm.clip.trans, ExpectedOfSet("wham.trans")), 1e-9);
  EXPECT_LT(LargestTurn(Joints(mdm.clip, 0, 22), ExpectedOfSet("wham.pose")), 1e-6);
  EXPECT_EQ(mdm.clip.frame_rate, 20);
  const Clip gvhmr = Import(Fixture("hand_sets/gvhmr.pkl"), options).clip;
  EXPECT_LT(MaxDifference(Joints(gvhmr, 1, 21), ExpectedOfSet("gvhmr.pose_body")), 1e-6);
}

TEST(DefaultHand, IsTheBodysHandWithItsWristWhereManosIs) {
  const std::shared_ptr<const BodyModel> body = BodyModel::Default();
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const std::shared_ptr<const BodyModel> model = DefaultHand(side);
    EXPECT_EQ(model->LoneHand(), side);
    const HandModel of_body(body, {}, side), alone(model, {}, side);
    HandState a(of_body), b(alone);
    JointPose pose = JointPose::Zero();
    a.SetBody(pose, Eigen::Vector3d::Zero());
    b.SetBody(pose, Eigen::Vector3d::Zero());
    const Eigen::Vector3d wrist = model->RestJoints(model->Template()).col(0);
    EXPECT_LT(
        (wrist - Eigen::Vector3d(side == Side::kRight ? 0.0957 : -0.0957, 0.0064, 0.0062)).norm(),
        1e-9);
    EXPECT_LT((b.WristPosition() - wrist).norm(), 1e-9);
    // The same vertices, bent or not, up to the place of the wrist.
    for (const double bend : {0.0, 0.4}) {
      const FingerPose fingers = FingerPose::Constant(bend);
      a.Evaluate(fingers, false);
      b.Evaluate(fingers, false);
      ASSERT_EQ(a.Vertices().cols(), b.Vertices().cols());
      const Eigen::Matrix3Xd difference = (a.Vertices().colwise() - a.WristPosition()) -
                                          (b.Vertices().colwise() - b.WristPosition());
      // At the edge the forearm's weight counts for the wrist; nothing else differs.
      EXPECT_LT(difference.colwise().norm().maxCoeff(), 1e-6) << bend;
    }
  }
}

TEST(DefaultHand, ServesClipsOfAHandWithoutAModel) {
  const TemporaryFolder folder;
  Clip clip = Import(Fixture("hand_sets/gigahands.json")).clip;
  WriteClip(clip, folder / "hand.npz");
  const LoadedClip loaded = LoadClip((folder / "hand.npz").string());
  EXPECT_EQ(loaded.body.model, DefaultHand(Side::kRight));
  EXPECT_THAT(ErrorText([&] {
                std::vector<std::string> notes;
                BodyOfClip(
                    "hand.npz", clip,
                    BodyModel::WithTemplate(BodyModel::Default(), BodyModel::Default()->Template()),
                    notes);
              }),
              HasSubstr("is a motion of a hand alone"));
}

}  // namespace
}  // namespace holdfast::testing
