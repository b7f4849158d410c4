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
  options.parameters.hand_models = {Fixture("hand_sets/MANO_RIGHT.pkl")};
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
  options.parameters.hand_models = {Fixture("hand_sets/MANO_RIGHT.pkl")};
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
  options.parameters.hand_models = {Fixture("hand_sets/MANO_RIGHT.pkl")};
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

TEST(ImportHandSets, H2oIsPutIntoTheFirstCamera) {
  const std::filesystem::path folder = Fixture("hand_sets/h2o/subject1/h1/0/cam4");
  const ImportedFile imported = Import(folder);
  ExpectSet("h2o", imported.clip, Side::kRight);
  EXPECT_EQ(imported.clip.object->name, "espresso");
  EXPECT_TRUE(Mentions(imported.notes, "no hand in 1 of 4 frames (1)"));
  EXPECT_LT(MaxDifference(Import(folder / "hand_pose_mano").clip.trans, imported.clip.trans),
            1e-12);
  EXPECT_EQ(SideOfHandAlone(Import(folder, Of(ImportedHands::kLeftAlone)).clip), Side::kLeft);
  const TemporaryFolder broken;
  std::filesystem::create_directory(broken / "hand_pose_mano");
  std::ofstream(broken / "hand_pose_mano" / "000000.txt") << "1 2 3\n";
  EXPECT_THAT(ImportFault(broken.Path()), HasSubstr("does not hold 124 numbers"));
  // Zeros are no rotation; a frame without the object keeps the nearest pose.
  const TemporaryFolder changed;
  std::filesystem::copy(folder, changed / "cam4", std::filesystem::copy_options::recursive);
  std::filesystem::remove(changed / "cam4" / "obj_pose_rt" / "000002.txt");
  EXPECT_TRUE(Mentions(Import(changed / "cam4").notes, "no pose of the object in 1 of 4 frames"));
  std::ofstream(changed / "cam4" / "cam_pose" / "000001.txt")
      << "0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1\n";
  EXPECT_THAT(ImportFault(changed / "cam4"), HasSubstr("has no rotation"));
}

TEST(ImportHandSets, ContactPoseIsAGraspInTheObjectsFrame) {
  ImportFileOptions options;
  options.parameters.hand_models = {Fixture("hand_sets/MANO_RIGHT.pkl")};
  const std::filesystem::path path = Fixture("hand_sets/contactpose/mug/mano_fits_15.json");
  const ImportedFile imported = Import(path, options);
  ExpectSet("contactpose", imported.clip, Side::kRight);
  EXPECT_EQ(imported.clip.object->name, "mug");
  EXPECT_THAT(ImportFault(path, Of(ImportedHands::kLeftAlone)), HasSubstr("has no left hand"));
}

TEST(ImportHandSets, OakInk2GivesABodyOrAHandWithTheObjectThatMoves) {
  const std::filesystem::path path = Fixture("hand_sets/oakink2.pkl");
  const ImportedFile hand = Import(path, Of(ImportedHands::kLeftAlone));
  ExpectSet("oakink2", hand.clip, Side::kLeft);
  EXPECT_EQ(hand.clip.object->name, "O02@0015@00001");
  EXPECT_EQ(hand.clip.frame_rate, 120);
  EXPECT_TRUE(Mentions(hand.notes, "no pose of the object in 1 of 4 frames"));
  const ImportedFile body = Import(path);
  EXPECT_LT(MaxDifference(Joints(body.clip, 1, 54), ExpectedOfSet("oakink2.pose")), 1e-6);
  EXPECT_LT(
      MaxDifference(body.clip.trans.colwise() + kSmplxRestPelvis, ExpectedOfSet("oakink2.pelvis")),
      1e-6);
  const Eigen::MatrixXd posed = Posed(ExpectedOfSet("cube"), *body.clip.object);
  EXPECT_LT(MaxDifference(posed.reshaped(24, 4), ExpectedOfSet("oakink2.object")), 1e-6);
  ImportFileOptions options;
  options.parameters.prop = "table";
  EXPECT_EQ(Import(path, options).clip.object->name, "table");
  options.parameters.prop = "chair";
  EXPECT_THAT(ImportFault(path, options), HasSubstr("no object 'chair'"));
}

TEST(ImportHandSets, HimoAndParaHomeHaveTheirObjectsElsewhere) {
  ImportFileOptions options;
  options.parameters.keep_ground = true;
  const ImportedFile himo = Import(Fixture("hand_sets/himo/smplx/S01T001.npz"), options);
  EXPECT_EQ(himo.clip.object->name, "Knife");
  const Eigen::MatrixXd cube = ExpectedOfSet("cube");
  EXPECT_LT(
      MaxDifference(Posed(cube, *himo.clip.object).reshaped(24, 5), ExpectedOfSet("himo.object")),
      1e-6);
  Eigen::MatrixXd joints(153, 5);
  joints << Joints(himo.clip, 1, 21), Joints(himo.clip, kLeftHandBegin, 30);
  EXPECT_LT(MaxDifference(joints, ExpectedOfSet("himo.pose")), 1e-9);

  const ImportedFile home = Import(Fixture("hand_sets/parahome/smplx_seq/s1/smplx_pose.pkl"));
  EXPECT_EQ(home.clip.object->name, "cup_base");
  EXPECT_LT(MaxDifference(Posed(cube, *home.clip.object).reshaped(24, 5),
                          ExpectedOfSet("parahome.object")),
            1e-6);
  joints << Joints(home.clip, 1, 21), Joints(home.clip, kLeftHandBegin, 30);
  EXPECT_LT(MaxDifference(joints, ExpectedOfSet("parahome.pose")), 1e-6);
  EXPECT_LT(MaxDifference(home.clip.trans, ExpectedOfSet("parahome.trans")), 1e-6);
  EXPECT_EQ(home.clip.gender, "female");
  EXPECT_EQ(home.clip.betas.size(), 20);
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
  const Clip mdm = Import(Fixture("hand_sets/sample00_rep00_smpl_params.npy")).clip;
  EXPECT_LT(MaxDifference(mdm.trans.colwise() + kSmplhRestPelvis, ExpectedOfSet("mdm.pelvis")),
            1e-6);
  EXPECT_LT(LargestTurn(Joints(mdm, 1, 21), ExpectedOfSet("mdm.pose_body")), 1e-6);
  for (int t = 0; t < mdm.NumFrames(); ++t) {
    const Eigen::Matrix3d root = ExpSO3(mdm.pose[t].col(0));
    EXPECT_LT((root.transpose().reshaped() - ExpectedOfSet("mdm.root").col(t)).norm(), 1e-6) << t;
  }
  EXPECT_EQ(mdm.frame_rate, 20);
  const Clip gvhmr = Import(Fixture("hand_sets/gvhmr.pkl"), options).clip;
  EXPECT_LT(MaxDifference(Joints(gvhmr, 1, 21), ExpectedOfSet("gvhmr.pose_body")), 1e-6);
}

TEST(ImportHandSets, HumotoAndMhrAreRefusedWithWhatIsMissing) {
  const TemporaryFolder folder;
  std::ofstream(folder / "humoto.json")
      << R"({"armature": [{"mixamorig:Hips": [1, 0, 0, 0, 0, 0, 0]}], "objects": {"cup": []}})";
  EXPECT_THAT(ImportFault(folder / "humoto.json"), HasSubstr(".glb"));
  std::ofstream(folder / "mhr.json") << R"({"mhr_model_params": [1, 2], "pred_cam_t": [0, 0, 1]})";
  EXPECT_THAT(ImportFault(folder / "mhr.json"), HasSubstr("MHR"));
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
