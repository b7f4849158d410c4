// SPDX-License-Identifier: MIT
#include "generator/actions/action_script.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/actions/action_catalog.h"
#include "generator/actions/face_marks.h"
#include "generator/actions/standing_start.h"
#include "generator/imos/vocabulary.h"
#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "tests/generator/test_body.h"
#include "tests/support/error_text.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

TriangleMesh Embedded(std::string_view name) {
  return ReadMesh(std::filesystem::path(HOLDFAST_MESHES_DIR) / "objects" /
                  (std::string(name) + ".ply"));
}

const FaceMarks& Face() {
  static const FaceMarks face = FindFaceMarks(BodySurface(BodyModel::Default()));
  return face;
}

ActionScene SceneWith(std::string_view object) {
  const BodyPlacement start =
      Place(DefaultMeasures().rest_joints, OwnStanding(DefaultMeasures(), 1).frames.front());
  ActionScene scene;
  scene.face = Face();
  scene.object = MarksOf(object, Embedded(object));
  scene.head.linear() = start.rotation[15];
  scene.head.translation() = start.joints.col(15);
  scene.shoulder = start.joints.col(17);
  scene.arm_m = 0.48;
  return scene;
}

Isometry3d Pose(double x, double turn = 0.0) {
  Isometry3d pose = Isometry3d::Identity();
  pose.translation() = Vector3d(x, 0.5 * x, -x);
  pose.linear() = ExpSO3(Vector3d(0.2, turn, 0.0));
  return pose;
}

// --- ActionPath ---------------------------------------------------------------------------------

TEST(ActionPath, IsAtItsKeysWhileItStaysAndAtRestThere) {
  const Isometry3d head = Pose(0.3, 0.7);
  const ActionPath path({{0.0, 0.5, Anchor::kWorld, Pose(0.1), Vector3d::Zero()},
                         {1.2, 1.5, Anchor::kHead, Pose(-0.1), Vector3d(0.1, 0.0, 0.2)},
                         {2.0, 2.0, Anchor::kHead, Pose(-0.2), Vector3d::Zero()},
                         {2.9, 3.0, Anchor::kWorld, Pose(0.4), Vector3d(0.0, 0.3, 0.0)}},
                        {});
  for (const double t : {-1.0, 0.0, 0.5}) EXPECT_TRUE(path.At(t).At(head).isApprox(Pose(0.1)));
  for (const double t : {1.2, 1.35, 1.5}) {
    EXPECT_TRUE(path.At(t).At(head).isApprox(head * Pose(-0.1), 1e-12)) << t;
  }
  EXPECT_TRUE(path.At(2.0).At(head).isApprox(head * Pose(-0.2), 1e-12));
  for (const double t : {2.9, 3.0, 9.0}) EXPECT_TRUE(path.At(t).At(head).isApprox(Pose(0.4)));
  // No jumps anywhere, and no speed on arrival.
  const double dt = 1e-4;
  for (double t = 0.0; t < 3.2; t += 0.01) {
    const Vector3d step =
        path.At(t + dt).At(head).translation() - path.At(t).At(head).translation();
    EXPECT_LT(step.norm(), 5.0 * dt) << t;
    if (std::abs(t - 0.5) < 1e-9 || std::abs(t - 1.2) < 1e-9) {
      EXPECT_LT(step.norm(), 1e-6);
    }
  }
}

TEST(ActionPath, BulgesByWhatItIsAskedInTheMiddle) {
  const Vector3d bulge(0.03, -0.02, 0.05);
  const Isometry3d head = Pose(0.2);
  for (const Anchor to : {Anchor::kWorld, Anchor::kHead}) {
    const ActionPath bent(
        {{0.0, 0.0, Anchor::kWorld, Pose(0.1), Vector3d::Zero()}, {1.0, 1.0, to, Pose(0.5), bulge}},
        {});
    const ActionPath straight({{0.0, 0.0, Anchor::kWorld, Pose(0.1), Vector3d::Zero()},
                               {1.0, 1.0, to, Pose(0.5), Vector3d::Zero()}},
                              {});
    EXPECT_TRUE((bent.At(0.5).At(head).translation() - straight.At(0.5).At(head).translation())
                    .isApprox(bulge, 1e-12));
  }
}

TEST(ActionPath, StrokesSwingAboutTheKeyAndFadeOut) {
  Stroke stroke;
  stroke.begin_s = 0.2;
  stroke.end_s = 2.2;
  stroke.period_s = 0.4;
  stroke.move = Vector3d(0.0, 0.02, 0.0);
  stroke.turn = Vector3d(0.0, 0.0, 0.3);
  stroke.pivot = Vector3d(0.1, 0.0, 0.0);
  const ActionPath path({{0.0, 3.0, Anchor::kWorld, Isometry3d::Identity(), Vector3d::Zero()}},
                        {stroke});
  EXPECT_TRUE(path.At(0.2).world.isApprox(Isometry3d::Identity()));
  EXPECT_TRUE(path.At(2.2).world.isApprox(Isometry3d::Identity()));
  // A quarter into the fourth stroke it is all the way there, its pivot moved by `move` alone.
  const Isometry3d there = path.At(0.2 + 3.25 * 0.4).world;
  EXPECT_TRUE((there * stroke.pivot - stroke.pivot).isApprox(stroke.move, 1e-9));
  EXPECT_NEAR(AngleBetween(there.linear(), Eigen::Matrix3d::Identity()), 0.3, 1e-9);
}

TEST(ActionPath, RefusesTimesThatGoBack) {
  EXPECT_THROW(ActionPath({}, {}), Error);
  EXPECT_THROW(ActionPath({{1.0, 2.0, Anchor::kWorld, Pose(0), Vector3d::Zero()},
                           {1.5, 3.0, Anchor::kWorld, Pose(0), Vector3d::Zero()}},
                          {}),
               Error);
}

// --- Scripts ------------------------------------------------------------------------------------

TEST(ActionScripts, OfAllActionsAndObjectsAreInTimeAndBeginStill) {
  for (const ScriptedAction& action : ScriptedActions()) {
    for (const std::string_view object : action.objects) {
      const ActionScene scene = SceneWith(object);
      for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        SCOPED_TRACE(std::string(action.name) + " " + std::string(object));
        RandomDraws draws(seed);
        const ActionScript script = WriteScript(action.name, scene, draws);
        ASSERT_GE(script.keys.size(), 2u);
        EXPECT_GE(script.keys.front().leave_s, 0.5);
        double before = 0.0;
        for (const ScriptKey& key : script.keys) {
          EXPECT_GE(key.arrive_s, before);
          EXPECT_GE(key.leave_s, key.arrive_s);
          EXPECT_EQ(key.poses.empty(), key.same_as.has_value());
          before = key.leave_s;
          for (const Isometry3d& pose : key.poses) {
            ASSERT_TRUE(pose.matrix().allFinite());
            EXPECT_NEAR(pose.linear().determinant(), 1.0, 1e-9);
          }
        }
        EXPECT_GE(script.duration_s, before);
        EXPECT_GT(script.duration_s, 1.4);
        EXPECT_LT(script.duration_s, 8.0);
        for (const Stroke& stroke : script.strokes) EXPECT_GT(stroke.begin_s, 0.5);
        EXPECT_EQ(script.handover.has_value(), action.name == "offhand");
      }
    }
  }
}

TEST(ActionScripts, AreTheSameForASeedAndOthersForAnother) {
  const ActionScene scene = SceneWith("mug");
  const auto duration = [&](std::uint64_t seed) {
    RandomDraws draws(seed);
    return WriteScript("drink", scene, draws).duration_s;
  };
  EXPECT_EQ(duration(3), duration(3));
  EXPECT_NE(duration(3), duration(4));
}

TEST(ActionScripts, DrinkPutsTheRimToTheMouth) {
  ActionScene scene = SceneWith("mug");
  RandomDraws draws(2);
  const ActionScript script = WriteScript("drink", scene, draws);
  const ScriptKey& tilted = script.keys[2];
  ASSERT_EQ(tilted.anchor, Anchor::kHead);
  for (const Isometry3d& pose : tilted.poses) {
    // The middle of the rim is a radius away, the mouth in the plane of the rim.
    const Vector3d mouth = pose.inverse() * scene.face.mouth;
    EXPECT_NEAR(mouth.z(), scene.object.rim.z(), 0.01);
    EXPECT_NEAR((mouth - scene.object.rim).head<2>().norm(), scene.object.rim_radius, 0.01);
    EXPECT_LT(pose.linear().col(2).z(), -0.4);  // leant towards the face
  }
}

// --- Catalog, marks, starts -------------------------------------------------------------------

// The rim of a cup that leans is nearest to the mouth on the mouth's side; what is there already
// lacks nothing.
TEST(FacePlace, OfACupIsTheRimOnTheMouthsSide) {
  ObjectMarks cup;
  cup.rim = Vector3d(0.0, 0.0, 0.1);
  cup.rim_radius = 0.04;
  const FaceMarks face;
  Eigen::Isometry3d head_from_object = Eigen::Isometry3d::Identity();
  head_from_object.linear() = ExpSO3(Vector3d(-M_PI / 2, 0.0, 0.0));  // z of the cup is up
  head_from_object.translation() = Vector3d(0.0, -0.3, 0.3);
  const auto place = FacePlaceOf("drink", cup, face, head_from_object);
  ASSERT_TRUE(place);
  const Vector3d mark = head_from_object * place->mark;
  EXPECT_NEAR(mark.x(), 0.0, 1e-9);
  EXPECT_NEAR(mark.y(), -0.2, 1e-9);
  EXPECT_NEAR(mark.z(), 0.26, 1e-9) << "towards the face";
  EXPECT_NEAR((place->place - face.mouth).norm(), 0.005, 1e-3);
  head_from_object.translation() += place->place - mark;
  const auto there = FacePlaceOf("drink", cup, face, head_from_object);
  EXPECT_LT((head_from_object * there->mark - there->place).norm(), 1e-9);
}

TEST(FacePlace, ActionsAwayFromTheFaceHaveNone) {
  for (const char* action : {"pour", "pass", "lift", "use", "offhand"}) {
    EXPECT_FALSE(FacePlaceOf(action, {}, {}, Eigen::Isometry3d::Identity())) << action;
  }
  for (const char* action : {"drink", "toast", "eat", "call", "takepicture", "brush"}) {
    EXPECT_TRUE(FacePlaceOf(action, {}, {}, Eigen::Isometry3d::Identity())) << action;
  }
}

TEST(ActionCatalog, HasGrabsNamesAndEmbeddedObjects) {
  EXPECT_GE(ScriptedActions().size(), 10u);
  for (const ScriptedAction& action : ScriptedActions()) {
    EXPECT_TRUE(imos::FindAction(action.name)) << action.name;
    for (const std::string_view object : action.objects) {
      EXPECT_NO_THROW(FindEmbedded("objects/" + std::string(object) + ".ply"));
      EXPECT_TRUE(imos::FindObject(imos::VocabularyName(object))) << object;
    }
  }
}

TEST(ActionCatalog, NamesTheNearestForAnUnknownAction) {
  EXPECT_THAT(testing::ErrorText([] { FindScriptedAction("drnk"); }),
              ::testing::AllOf(HasSubstr("'drink'"), HasSubstr("takepicture")));
}

TEST(ObjectMarks, OfTheMugAreItsRim) {
  const ObjectMarks marks = MarksOf("mug", Embedded("mug"));
  EXPECT_NEAR(marks.rim.z(), 0.096, 0.002);
  EXPECT_NEAR(marks.rim_radius, 0.041, 0.003);
  EXPECT_NEAR(marks.rim.y(), 0.0, 0.002);
  EXPECT_LT(marks.rim.x(), -0.01);  // the handle is at +x
}

TEST(ObjectMarks, GoWithTheMeshIntoAMirror) {
  for (const std::string_view name : {"mug", "teapot", "camera", "knife"}) {
    const TriangleMesh mesh = Embedded(name);
    const TriangleMesh mirrored = ReflectX(mesh);
    EXPECT_NEAR(SignedVolume(mirrored), SignedVolume(mesh), 1e-12);  // still faces outwards
    const ObjectMarks marks = ReflectX(MarksOf(name, mesh));
    EXPECT_NEAR((marks.rim - MarksOf("", mirrored).rim).norm(), 0.0, 1e-9);
  }
}

TEST(FaceMarks, LieOnTheFace) {
  const FaceMarks& face = Face();
  EXPECT_NEAR(face.mouth.x(), 0.0, 1e-9);
  EXPECT_LT(face.mouth.y(), face.eyes.y() - 0.04);
  EXPECT_GT(face.mouth.z(), 0.08);
  EXPECT_LT(face.right_ear.x(), -0.06);
  EXPECT_NEAR(face.right_ear.y(), face.eyes.y(), 0.03);
  EXPECT_GT(SignedVolume(face.head), 0.002);  // closed, outwards: litres
}

TEST(StandingStart, IsTheSameWhereverTheBodyRests) {
  const StandingStart here = OwnStanding(DefaultMeasures(), 7),
                      there = OwnStanding(MeasuresAt({0.2, -0.4, 0.1}), 7);
  for (std::size_t t = 0; t < here.frames.size(); t += 10) {
    EXPECT_LT((here.frames[t].pelvis - there.frames[t].pelvis).norm(), 1e-6);
    for (const int j : {13, 14, 16, 17, 18, 19, 20, 21}) {
      EXPECT_LT(here.frames[t].local[j].angularDistance(there.frames[t].local[j]), 1e-4)
          << kJointNames[j];
    }
  }
}

TEST(StandingStart, IsFoundInStandingOnly) {
  const Eigen::Matrix3Xd& rest = DefaultMeasures().rest_joints;
  const StandingStart own = OwnStanding(DefaultMeasures(), 7);
  // Somewhere else, facing elsewhere.
  std::vector<BodyFrame> frames = own.frames;
  const PlanarMove away{1.3, {2.0, -4.0}};
  for (BodyFrame& frame : frames) frame = away * frame;
  const std::vector<StandingStart> found = FindStandingStarts(rest, frames);
  ASSERT_FALSE(found.empty());
  const BodyFrame& first = found.front().frames.front();
  EXPECT_NEAR(first.pelvis.x(), 0.0, 1e-9);
  EXPECT_NEAR(first.pelvis.y(), 0.0, 1e-9);
  EXPECT_NEAR(Yaw(first), 0.0, 1e-9);
  // Who bends over or walks does not stand.
  for (BodyFrame& frame : frames) {
    frame.local[3] = Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Vector3d::UnitX()));
  }
  EXPECT_TRUE(FindStandingStarts(rest, frames).empty());
  std::vector<BodyFrame> sliding = own.frames;
  for (std::size_t t = 0; t < sliding.size(); ++t)
    sliding[t].pelvis.x() += 0.03 * static_cast<double>(t);
  EXPECT_TRUE(FindStandingStarts(rest, sliding).empty());
}

TEST(StandingStart, IdlesAsLongAsAskedWithoutJumps) {
  const StandingStart own = OwnStanding(DefaultMeasures(), 7);
  const std::vector<BodyFrame> idle = IdleMotion(DefaultMeasures(), own, 400);
  ASSERT_EQ(idle.size(), 400u);
  for (std::size_t t = 1; t < idle.size(); ++t) {
    EXPECT_LT((idle[t].pelvis - idle[t - 1].pelvis).norm(), 0.004) << t;
    for (int j = 0; j < kNumBodyJoints; ++j) {
      EXPECT_LT(idle[t].local[j].angularDistance(idle[t - 1].local[j]), 0.03) << t << " " << j;
    }
  }
}

}  // namespace
}  // namespace holdfast
