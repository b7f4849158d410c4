// SPDX-License-Identifier: MIT
// The main job through the program: on the embedded default, and on real motion with real objects.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "generator/actions/face_marks.h"
#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "tests/support/data_folder.h"
#include "tests/support/program.h"
#include "tests/support/published_files.h"

namespace holdfast {
namespace {

using testing::DataFolder;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::RunHoldfast;

using EmbeddedDefault = testing::ProgramTest;

// What every fit must be: in contact, not through each other, and without a jump between frames
// that the wrist does not make itself.
void ExpectHeld(const ProgramFolder& folder, const std::string& output, Side side) {
  const nlohmann::json metrics = folder.ReadJson(output + "/metrics.json");
  const nlohmann::json& summary = metrics["summary"];
  EXPECT_EQ(summary["frames_failed"], 0);
  EXPECT_GE(summary["frames_in_contact_ratio"].get<double>(), 0.95);
  EXPECT_LT(summary["mean_max_penetration_depth_mm"].get<double>(), 3.0);
  const Clip clip = ReadClip(folder / (output + "/clip.npz"));
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  for (const char* key :
       {"energy_distance_m2", "energy_contact_m2", "energy_temporal", "iterations", "stop",
        "penetration_depth_mm", "contact_ratio", "intersection_volume_cm3"}) {
    EXPECT_EQ(metrics["per_frame"][key].size(), frames) << key;
  }
  EXPECT_FALSE(metrics["per_frame"].contains("solve_ms"));
  EXPECT_FALSE(summary.contains("solve_ms_median"));
  const nlohmann::json times = folder.ReadJson(output + "/timing.json");
  EXPECT_EQ(times["per_frame"]["solve_ms"].size(), frames);
  EXPECT_GT(times["summary"]["solve_ms_median"].get<double>(), 0.0);
  ASSERT_TRUE(clip.object.has_value());
  EXPECT_GT(ReadMesh(folder / (output + "/object.ply")).NumVertices(), 100);

  const auto body = BodyModel::Default();
  const Eigen::Matrix3Xd rest = body->RestJoints(body->Template());
  BodyState state;
  const int wrist = WristJoint(side);
  Eigen::Vector3d object_in_wrist_before = Eigen::Vector3d::Zero();
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(rest, clip.pose[t], clip.trans.col(t), state);
    const Eigen::Vector3d object_in_wrist = state.world_rotation[wrist].transpose() *
                                            (clip.object->trans.col(t) - state.joints.col(wrist));
    if (t > 0) {
      EXPECT_LT((object_in_wrist - object_in_wrist_before).norm(), 0.005) << output << " " << t;
    }
    object_in_wrist_before = object_in_wrist;
  }
}

// The demo's mug stands upright while the person has just taken it, and its rim is at the lips
// while they drink.
void ExpectDrunkFrom(const Clip& clip, const TriangleMesh& mesh) {
  const BodySurface body(BodyModel::Default(), {});
  const FaceMarks face = FindFaceMarks(body);
  const ObjectMarks mug = MarksOf("mug", mesh);
  const auto world_from_mug = [&](int t) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = ExpSO3(clip.object->orient.col(t));
    pose.translation() = clip.object->trans.col(t);
    return pose;
  };
  for (int t = 0; t <= 6; ++t) {
    const double tilt_rad = std::acos(std::min(1.0, world_from_mug(t).linear()(2, 2)));
    EXPECT_LT(tilt_rad * 180.0 / std::numbers::pi, 3.0) << t;
  }
  BodyState state;
  for (int t = 48; t <= 72; ++t) {
    ForwardJoints(body.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    const Eigen::Vector3d mouth = state.joints.col(15) + state.world_rotation[15] * face.mouth;
    const Eigen::Vector3d from_rim = world_from_mug(t).inverse() * mouth - mug.rim;
    const double across = from_rim.head<2>().norm() - mug.rim_radius;
    EXPECT_LT(std::hypot(across, from_rim.z()), 0.013) << t;
  }
}

TEST_F(EmbeddedDefault, AMugIsHeldThroughTheDemo) {
  const ProgramResult result = folder.Run("fit demo_drink mug --drinking off -o held");
  EXPECT_THAT(result.out, HasSubstr("held/clip.npz: mug held by the right hand"));
  ExpectHeld(folder, "held", Side::kRight);
  EXPECT_THAT(result.err, Not(HasSubstr("warning")));
  EXPECT_THAT(result.err, Not(HasSubstr("note")));
  const nlohmann::json metrics = folder.ReadJson("held/metrics.json");
  EXPECT_EQ(metrics["grasp"]["style"], "handle");
  ExpectDrunkFrom(ReadClip(folder / "held/clip.npz"), ReadMesh(folder / "held/object.ply"));
}

TEST_F(EmbeddedDefault, WhoDrinksBringsTheRimToTheMouthUnlessToldNotTo) {
  for (const char* vessel : {"bottle", "wineglass"}) {
    const std::string fit = std::string("fit demo_drink ") + vessel + " --no-report -f -o ";
    EXPECT_THAT(folder.Run(fit + "drunk").err, HasSubstr("the person drinks")) << vessel;
    const nlohmann::json drink = folder.ReadJson("drunk/metrics.json")["drink"];
    EXPECT_LT(drink["rim_from_mouth_mm"], 10.0) << vessel;
    EXPECT_LT(drink["lean_on_table_deg"], 2.0) << vessel;
    folder.Run(fit + "held --drinking off");
    EXPECT_FALSE(folder.ReadJson("held/metrics.json").contains("drink")) << vessel;
  }
  folder.Run("fit demo_drink cube --no-report -o cube");
  EXPECT_FALSE(folder.ReadJson("cube/metrics.json").contains("drink"));
}

TEST_F(EmbeddedDefault, AHandleThatIsNotThereIsAFailure) {
  folder.Fails("fit demo_drink sphere --style handle -o held", 3, "or another --style");
}

TEST_F(EmbeddedDefault, TheLeftHandHoldsAsWell) {
  const ProgramResult result =
      folder.Run("fit demo_inspect cylinder -o held --hand left --end 20 -q");
  EXPECT_EQ(result.err, "");
  ExpectHeld(folder, "held", Side::kLeft);
}

TEST_F(EmbeddedDefault, AFittedClipIsFittedAgainFromItsOwnGrasp) {
  folder.Run("fit demo_drink sphere --end 8 -q -o first");
  const ProgramResult again = folder.Run("fit first/clip.npz first/object.ply -q --json -o second");
  EXPECT_EQ(nlohmann::json::parse(again.out)["grasp"]["made"], false);
  const Clip a = ReadClip(folder / "first/clip.npz"), b = ReadClip(folder / "second/clip.npz");
  EXPECT_LT((a.object->trans - b.object->trans).cwiseAbs().maxCoeff(), 1e-4);
}

TEST_F(EmbeddedDefault, AGraspBelongsToTheObjectItWasMadeFor) {
  folder.Run("fit demo_drink mug --hand left --end 8 -q -o held");
  // The same mug by another name, coarser: its grasp is kept.
  folder.Run("decimate held/object.ply -o cup.ply --vertices 300 -q");
  ProgramResult result = folder.Run("fit held/clip.npz cup.ply --json -o cup");
  EXPECT_EQ(nlohmann::json::parse(result.out)["grasp"]["made"], false);
  EXPECT_THAT(result.err, Not(HasSubstr("making a new grasp")));
  // Another object, by the mug's name too, is grasped anew, with the hand that held the mug.
  folder.Run("fit demo_drink apple --end 1 -q -o apple");
  std::filesystem::rename(folder / "apple/object.ply", folder / "mug.ply");
  result = folder.Run("fit held/clip.npz mug.ply --json -o other");
  EXPECT_THAT(result.err,
              HasSubstr("the clip's grasp is of mug, not of mug.ply: making a new grasp"));
  const nlohmann::json made = nlohmann::json::parse(result.out);
  EXPECT_EQ(made["grasp"]["made"], true);
  EXPECT_EQ(made["held_by"], "the left hand");
  ExpectHeld(folder, "other", Side::kLeft);
  // Without the mesh, names decide.
  std::filesystem::remove(folder / "held/object.ply");
  result = folder.Run("fit held/clip.npz apple --end 3 -o anew");
  EXPECT_THAT(result.err, HasSubstr("the clip's grasp is of mug, not of apple"));
  result =
      RunHoldfast(folder.Path(), "fit held/clip.npz apple --end 3 --keep-grasp -o kept --json");
  EXPECT_THAT(result.err, Not(HasSubstr("making a new grasp")));
}

TEST_F(EmbeddedDefault, AnObjectThatNoHandTouchesIsAFailure) {
  folder.Run("fit demo_drink apple --end 5 -q -o held");
  Clip clip = ReadClip(folder / "held/clip.npz");
  clip.object->trans.row(2).array() += 0.5;
  WriteClip(clip, folder / "held/clip.npz");
  const ProgramResult result = folder.Run("fit held/clip.npz apple -o away", 3);
  EXPECT_THAT(result.err, HasSubstr("touches no hand in any frame"));
  EXPECT_THAT(result.err, HasSubstr("--regrasp"));
  EXPECT_EQ(testing::Listing(folder.Path()), "held ");
}

TEST_F(EmbeddedDefault, CtrlCLeavesNothingBehind) {
  // The grasp of a teapot alone takes longer than this.
  const ProgramResult result =
      folder.Run("fit demo_inspect teapot -o held -q", 130, "timeout --preserve-status -s INT 0.7");
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(testing::Listing(folder.Path()), "");
}

TEST_F(EmbeddedDefault, BetasOfAnotherBodyAreNotTakenForItsOwn) {
  // An AMASS clip's betas are SMPL-X's. The embedded body does without them, and the fitted clip,
  // which is the embedded body's, must not claim them for it: whoever opens it would see another
  // hand than the one fitted.
  folder.Run("fit demo_drink sphere --end 2 -q -o first");
  Clip amass = ReadClip(folder / "first/clip.npz");
  amass.betas = Eigen::VectorXd::Constant(10, 2.0);
  amass.body_model.clear();
  amass.trans = testing::TransFor(amass, testing::SmplxPelvis());
  WriteClip(amass, folder / "amass.npz");
  EXPECT_THAT(folder.Run("fit amass.npz first/object.ply -o second").err,
              HasSubstr("betas belong to SMPL-X"));
  const Clip fitted = ReadClip(folder / "second/clip.npz");
  EXPECT_EQ(fitted.body_model, "holdfast_neutral");
  EXPECT_TRUE(fitted.betas.isZero(0.0));
}

struct RealCase {
  const char* motion;
  const char* object;
  const char* hand;
};

std::ostream& operator<<(std::ostream& out, const RealCase& c) {
  return out << c.motion << ", " << c.object << ", " << c.hand;
}

class RealMotion : public ::testing::TestWithParam<RealCase> {};

TEST_P(RealMotion, HoldsARealObject) {
  const RealCase& c = GetParam();
  const std::filesystem::path motion = DataFolder() / "mocap" / c.motion;
  const std::filesystem::path object = DataFolder() / "objects" / c.object;
  if (!std::filesystem::exists(motion) || !std::filesystem::exists(object)) {
    GTEST_SKIP() << motion << " or " << object
                 << " is not there: set HOLDFAST_DATA to the folder with mocap/ and objects/";
  }
  const ProgramFolder folder;
  folder.Run("import '" + motion.string() + "' -o clip.npz -q");
  folder.Run("fit clip.npz '" + object.string() + "' -o held -q --hand " + c.hand);
  ExpectHeld(folder, "held", std::string(c.hand) == "left" ? Side::kLeft : Side::kRight);
}

// With the first seed, the only clean grasps put the camera into the thigh.
TEST(FitHeldAtTheThigh, SearchesAgainWhereTheObjectGoesThroughTheBody) {
  const std::filesystem::path motion =
      DataFolder() / "mocap/sb_reach/ChrHarmony_Relax001_ArmReachRtMidLow.bvh.gz";
  if (!std::filesystem::exists(motion)) {
    GTEST_SKIP() << motion << " is not there: set HOLDFAST_DATA to the folder with mocap/";
  }
  const ProgramFolder folder;
  folder.Run("fit '" + motion.string() + "' camera -o held -q --hand right");
  const auto score = folder.Json("score held --exact off --json -q")["clips"][0]["values"];
  EXPECT_LT(score["object_in_body_max_mm"].get<double>(), 2.0);
}

INSTANTIATE_TEST_SUITE_P(
    Shared, RealMotion,
    ::testing::Values(RealCase{"sb_reach/ChrGarza_IdleStand01_ReachForwardMediumFar01.bvh.gz",
                               "025_mug.obj", "right"},
                      RealCase{"sb_reach/ChrHarmony_Relax001_ArmReachRtHigh.bvh.gz",
                               "011_banana.obj", "right"},
                      RealCase{"sb_reach/ChrHarmony_Relax001_ArmReachLfMidHigh.bvh.gz",
                               "005_tomato_soup_can.obj", "left"}));

}  // namespace
}  // namespace holdfast
