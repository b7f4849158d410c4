// SPDX-License-Identifier: MIT
// What the inspection measures in a motion, on motions whose conventions are known.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "geometry/embedded.h"
#include "geometry/inspect/inspection.h"
#include "geometry/rotation.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

Clip DemoClip() {
  const EmbeddedFile file = FindEmbedded("clips/demo_drink.npz");
  return ReadClip(NpzReader(file.bytes, "demo_drink"));
}

// With an object that stays `at` that place of a wrist's frame.
Clip Carrying(Clip clip, int wrist, const Eigen::Vector3d& at) {
  const auto body = BodyModel::Default();
  const Eigen::Matrix3Xd rest = body->RestJoints(body->Template());
  const Eigen::Matrix3d in_wrist = ExpSO3(Eigen::Vector3d(0.4, -0.9, 0.5));
  clip.object.emplace();
  clip.object->trans.resize(3, clip.NumFrames());
  clip.object->orient.resize(3, clip.NumFrames());
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(rest, clip.pose[t], clip.trans.col(t), state);
    clip.object->trans.col(t) = state.joints.col(wrist) + state.world_rotation[wrist] * at;
    clip.object->orient.col(t) = LogSO3(state.world_rotation[wrist] * in_wrist);
  }
  return clip;
}

Clip CarryingClip() { return Carrying(DemoClip(), 21, {-0.1, -0.03, 0.02}); }

class InspectClip : public ::testing::Test {
 protected:
  Inspection Look(const Clip& clip, const std::string& name = "clip.npz") {
    WriteClip(clip, folder_ / name);
    return Inspect(folder_ / name);
  }
  TemporaryFolder folder_;
};

std::string Text(const Inspection& inspection, const std::string& fact) {
  for (const Fact& f : inspection.facts) {
    if (f.name == fact) return std::get<std::string>(f.value);
  }
  return "(absent)";
}

double Number(const Inspection& inspection, const std::string& fact) {
  for (const Fact& f : inspection.facts) {
    if (f.name == fact) return std::get<double>(f.value);
  }
  return NAN;
}

std::string Findings(const Inspection& inspection) {
  static constexpr const char* kNames[] = {"ok", "warning", "fault"};
  std::string text;
  for (const Finding& f : inspection.findings) {
    text +=
        std::string(kNames[static_cast<int>(f.verdict)]) + ": " + f.text + " -> " + f.fix + "\n";
  }
  return text;
}

TEST_F(InspectClip, ASoundClipIsSound) {
  const Inspection inspection = Look(DemoClip());
  EXPECT_EQ(inspection.identity.kind, FileKind::kClip);
  EXPECT_EQ(inspection.Worst(), Verdict::kOk) << Findings(inspection);
  EXPECT_EQ(Text(inspection, "up_axis"), "z");
  EXPECT_EQ(Number(inspection, "meters_per_unit"), 1.0);
  EXPECT_NEAR(Number(inspection, "ground_height_m"), 0.0, 0.01);
  EXPECT_EQ(Text(inspection, "hand_pose"), "full");
  EXPECT_EQ(Number(inspection, "leaps"), 0.0);
  EXPECT_THAT(inspection.next.front(), HasSubstr("holdfast fit "));
}

TEST_F(InspectClip, TellsColumnsFromRows) {
  Clip clip = CarryingClip();
  const Inspection columns = Look(clip);
  EXPECT_EQ(Text(columns, "object_rotation"), "column") << Findings(columns);
  EXPECT_EQ(Text(columns, "holding_hand"), "right");
  EXPECT_NE(columns.Worst(), Verdict::kFault);

  clip.object->orient *= -1.0;  // the transpose
  const Inspection rows = Look(clip);
  EXPECT_EQ(Text(rows, "object_rotation"), "row");
  EXPECT_EQ(rows.Worst(), Verdict::kFault);
  EXPECT_THAT(Findings(rows), HasSubstr("as in GRAB"));

  clip.object->orient.setZero();  // never turns: both agree
  EXPECT_EQ(Text(Look(clip), "object_rotation"), "undecided");
}

TEST_F(InspectClip, TellsWhichHandCarries) {
  Clip clip = DemoClip();
  for (JointPose& pose : clip.pose) pose = MirrorPose(pose);
  clip = Carrying(clip, 20, {0.1, -0.03, 0.02});
  clip.holding_hand.assign(static_cast<std::size_t>(clip.NumFrames()), kHoldsRight);
  const Inspection inspection = Look(clip);
  EXPECT_EQ(Text(inspection, "holding_hand"), "left");
  EXPECT_THAT(Findings(inspection), HasSubstr("holding_hand is never left"));
}

// Turned about the pelvis so that y is up, as files of other programs are.
Clip YUp(Clip clip) {
  const auto body = BodyModel::Default();
  const Eigen::Vector3d pelvis = body->RestJoints(body->Template()).col(0);
  const Eigen::Matrix3d turn = ExpSO3(Eigen::Vector3d(-std::numbers::pi / 2, 0, 0));
  for (int t = 0; t < clip.NumFrames(); ++t) {
    clip.pose[t].col(0) = LogSO3(turn * ExpSO3(clip.pose[t].col(0)));
    clip.trans.col(t) = turn * (clip.trans.col(t) + pelvis) - pelvis;
    if (clip.object) {
      clip.object->trans.col(t) = (turn * clip.object->trans.col(t)).eval();
      clip.object->orient.col(t) = LogSO3(turn * ExpSO3(clip.object->orient.col(t)));
    }
  }
  return clip;
}

// Runs a suggested command in the folder of the files.
bool RunSuggested(const TemporaryFolder& folder, std::string command) {
  if (command.starts_with("python3")) command = "/usr/bin/" + command;
#ifdef HOLDFAST_PROGRAM
  if (command.starts_with("holdfast ")) command = HOLDFAST_PROGRAM + command.substr(8);
#endif
  std::ofstream(folder / "command.sh") << "cd '" << folder.Path().string() << "'\n"
                                       << command << "\n";
  return std::system(("sh '" + (folder / "command.sh").string() + "'").c_str()) == 0;
}

bool HasNumpy() { return std::system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") == 0; }

TEST_F(InspectClip, SeesYUpAndItsCommandTurnsIt) {
  const Clip clip = CarryingClip();
  const Inspection inspection = Look(YUp(clip));
  EXPECT_EQ(Text(inspection, "up_axis"), "y");
  EXPECT_EQ(inspection.Worst(), Verdict::kFault);
  EXPECT_NEAR(Number(inspection, "ground_height_m"), 0.0, 0.01);
  EXPECT_EQ(Text(inspection, "object_rotation"), "column");  // whatever is up
  if (!HasNumpy()) GTEST_SKIP() << "python3-numpy is not installed";
  ASSERT_EQ(inspection.next.size(), 1u);
  ASSERT_TRUE(RunSuggested(folder_, inspection.next[0]));
  const Clip turned = ReadClip(folder_ / "clip_zup.npz");
  EXPECT_LT((turned.trans - clip.trans).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT((turned.object->trans - clip.object->trans).cwiseAbs().maxCoeff(), 1e-5);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    EXPECT_LT(AngleBetween(ExpSO3(turned.pose[t].col(0)), ExpSO3(clip.pose[t].col(0))), 1e-5);
    EXPECT_LT(
        AngleBetween(ExpSO3(turned.object->orient.col(t)), ExpSO3(clip.object->orient.col(t))),
        1e-5);
  }
}

TEST_F(InspectClip, SeesCentimetersAndMillimeters) {
  for (const double scale : {100.0, 1000.0}) {
    Clip clip = DemoClip();
    clip.trans *= scale;
    const Inspection inspection = Look(clip);
    EXPECT_DOUBLE_EQ(Number(inspection, "meters_per_unit"), 1.0 / scale);
    EXPECT_EQ(inspection.Worst(), Verdict::kFault);
    EXPECT_THAT(Findings(inspection), HasSubstr(scale == 100.0 ? "centimeters" : "millimeters"));
  }
}

TEST_F(InspectClip, SeesARaisedGround) {
  Clip clip = DemoClip();
  clip.trans.row(2).array() += 0.3;
  const Inspection inspection = Look(clip);
  EXPECT_NEAR(Number(inspection, "ground_height_m"), 0.3, 0.01);
  EXPECT_EQ(inspection.Worst(), Verdict::kWarning);
}

TEST_F(InspectClip, TellsFullFingerPosesFromDifferences) {
  Clip clip = DemoClip();
  const auto body = BodyModel::Default();
  for (JointPose& pose : clip.pose) {
    for (const Side side : {Side::kRight, Side::kLeft}) {
      SetFingers(pose, side, FingersOf(pose, side) - body->HandMean(side));
    }
  }
  const Inspection relative = Look(clip);
  EXPECT_EQ(Text(relative, "hand_pose"), "relative") << Findings(relative);
  EXPECT_THAT(Findings(relative), HasSubstr("flat_hand_mean=False"));
  for (JointPose& pose : clip.pose) pose.rightCols(30).setZero();
  EXPECT_EQ(Text(Look(clip), "hand_pose"), "zero");
}

TEST_F(InspectClip, FindsLeapsAndImpossibleBends) {
  Clip clip = DemoClip();
  clip.pose[60].col(18) += Eigen::Vector3d(0, 1.5, 0);
  clip.trans.col(100) += Eigen::Vector3d(1.0, 0, 0);
  Inspection inspection = Look(clip);
  EXPECT_GE(Number(inspection, "leaps"), 2.0);
  EXPECT_THAT(Findings(inspection), HasSubstr("frame 60: left_elbow by 86 degrees"));
  EXPECT_EQ(inspection.Worst(), Verdict::kWarning);

  clip = DemoClip();
  for (JointPose& pose : clip.pose) pose.col(12) = Eigen::Vector3d(2.5, 0, 0);
  inspection = Look(clip);
  EXPECT_EQ(Number(inspection, "overbent_joints"), 1.0);
  EXPECT_THAT(Findings(inspection), HasSubstr("neck"));
}

TEST_F(InspectClip, SeesJointsInAnotherOrder) {
  Clip clip = DemoClip();
  // As if legs and arms were exchanged: what bends about x bends about y.
  for (JointPose& pose : clip.pose) {
    pose.col(4) = Eigen::Vector3d(0, 0, 1.2);
    pose.col(18) = Eigen::Vector3d(1.0, 0, 0);
    pose.col(19) = Eigen::Vector3d(1.0, 0, 0);
  }
  const Inspection inspection = Look(clip);
  EXPECT_LT(Number(inspection, "hinge_agreement"), 0.6);
  EXPECT_THAT(Findings(inspection), HasSubstr("another order"));
}

TEST_F(InspectClip, CountsNaN) {
  const Clip clip = DemoClip();
  NpzWriter writer;
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  std::vector<double> body(63 * frames, 0.0);
  body[63 * 7 + 5] = NAN;
  body[63 * 9] = INFINITY;
  writer.AddFloat64("mocap_frame_rate", {}, {30.0});
  writer.AddFloat64("trans", {frames, 3}, std::vector<double>(3 * frames, 0.9));
  writer.AddFloat64("root_orient", {frames, 3}, std::vector<double>(3 * frames, 0.5));
  writer.AddFloat64("pose_body", {frames, 63}, body);
  writer.Write(folder_ / "nan.npz");
  const Inspection inspection = Inspect(folder_ / "nan.npz");
  EXPECT_EQ(inspection.Worst(), Verdict::kFault);
  EXPECT_THAT(Findings(inspection),
              HasSubstr("pose_body holds 2 NaN, infinite or huge numbers, the first in frame 7"));
}

TEST_F(InspectClip, ConvertsWhatAmassAndSmplxWrite) {
  if (!HasNumpy()) GTEST_SKIP() << "python3-numpy is not installed";
  const Clip clip = DemoClip();
  WriteClip(clip, folder_ / "clip.npz");
  const std::string script =
      "import numpy as np\n"
      "c = np.load('clip.npz'); n = len(c['trans'])\n"
      "p = np.hstack([c['root_orient'], c['pose_body'], c['pose_hand']])\n"
      "np.savez('smplh.npz', poses=p, trans=c['trans'], mocap_framerate=30.0, betas=np.zeros(16),"
      " gender=np.array(b'female'))\n"
      "np.savez('smplx.npz', global_orient=c['root_orient'], transl=c['trans'],"
      " body_pose=c['pose_body'].reshape(n, 21, 3), left_hand_pose=c['pose_hand'][:, :45],"
      " right_hand_pose=c['pose_hand'][:, 45:])\n";
  std::ofstream(folder_ / "write.py") << script;
  ASSERT_TRUE(RunSuggested(folder_, "python3 write.py"));
  struct Case {
    const char* file;
    FileKind kind;
    const char* result;
  };
  for (const Case& c : {Case{"smplh.npz", FileKind::kSmplhMotion, "smplh_clip.npz"},
                        Case{"smplx.npz", FileKind::kParameters, "smplx_clip.npz"}}) {
    const Inspection inspection = Inspect(folder_ / c.file);
    EXPECT_EQ(inspection.identity.kind, c.kind) << c.file;
    EXPECT_NE(inspection.Worst(), Verdict::kFault) << c.file;
    ASSERT_FALSE(inspection.next.empty()) << c.file;
    ASSERT_TRUE(RunSuggested(folder_, inspection.next.front())) << inspection.next.front();
    const Clip converted = ReadClip(folder_ / c.result);
    EXPECT_EQ(converted.frame_rate, 30);
    ASSERT_EQ(converted.NumFrames(), clip.NumFrames());
    for (int t = 0; t < clip.NumFrames(); ++t) {
      EXPECT_LT((converted.pose[t] - clip.pose[t]).leftCols(22).cwiseAbs().maxCoeff(), 1e-12);
      EXPECT_LT((converted.pose[t] - clip.pose[t]).rightCols(30).cwiseAbs().maxCoeff(), 1e-12);
    }
  }
}

}  // namespace
}  // namespace holdfast
