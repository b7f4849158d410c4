// SPDX-License-Identifier: MIT
// Markers put on the embedded body in a known motion, and the motion recovered from them.
#include "solver/markers/solve_markers.h"

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "generator/body/limb_ik.h"
#include "geometry/error.h"
#include "geometry/rotation.h"
#include "solver/markers/marker_json.h"
#include "tests/support/data_folder.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;

std::vector<std::string> UpperLimbNames(bool still) {
  std::vector<std::string> names = {"STRN"};
  for (const std::string side : {"R", "L"}) {
    for (const char* const plate : {"SHO", "UAR", "LAR", "HAN"}) {
      for (const char* const k : {"1", "2", "3", "4"}) names.push_back(side + plate + k);
    }
    for (const char* const single : {"FTP", "FB", "THUM"}) names.push_back(side + single);
    if (!still) continue;
    for (const char* const single : {"GTH", "LEP", "MEP", "SPR", "SPU"}) {
      names.push_back(side + single);
    }
  }
  return names;
}

// A seated person who faces +y: arms forward, or the right hand to the mouth and back.
struct Person {
  std::shared_ptr<const BodyModel> model = BodyModel::Default();
  Eigen::VectorXd betas = Eigen::Vector3d(0.8, -0.6, 0.4);
  BodySurface surface = BodySurface(model, betas);

  JointPose Pose(double drink, bool forward) const {
    JointPose pose = JointPose::Zero();
    pose.col(0) = LogSO3(ExpSO3(Eigen::Vector3d::UnitZ() * std::numbers::pi) *
                         ExpSO3(Eigen::Vector3d::UnitX() * 90.0 * kDegree));
    for (const int hip : {kLeftHip, kRightHip}) pose(0, hip) = -90.0 * kDegree;
    for (const int knee : {kLeftKnee, kRightKnee}) pose(0, knee) = 90.0 * kDegree;
    pose.col(kSpine2) = Eigen::Vector3d(0.1 * drink, 0.05 * drink, 0.0);
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const bool right = side == Side::kRight;
      const double sign = right ? 1.0 : -1.0, lift = right ? drink : 0.0;
      const int shoulder = right ? kRightShoulder : kLeftShoulder;
      pose.col(shoulder) = forward ? Eigen::Vector3d(0.0, sign * 80.0 * kDegree, 0.0)
                                   : Eigen::Vector3d(-0.4 * lift, sign * (0.4 + 0.5 * lift),
                                                     sign * (1.1 - 0.5 * lift));
      pose.col(shoulder + 2) =
          (forward ? 0.1 : 1.2 + 0.8 * lift) * Arm(side).hinge + Eigen::Vector3d(0.3 * lift, 0, 0);
      pose.col(shoulder + 4) = Eigen::Vector3d(0.0, 0.1 * lift, sign * 0.2);
    }
    return pose;
  }
  BodyState State(double drink, bool forward) const {
    BodyState state;
    ForwardJoints(surface.RestJoints(), Pose(drink, forward), Eigen::Vector3d(0.1, -0.2, 0.3),
                  state);
    return state;
  }

  // Markers are fixed to bones about where their names say, each off by up to a centimeter, and
  // seen with 0.2 mm of noise.
  MarkerRecording Record(int frames, bool still) const {
    MarkerRecording recording;
    recording.names = UpperLimbNames(still);
    recording.subjects.assign(recording.names.size(), "");
    recording.rate_hz = 50.0;
    recording.unit = "mm";
    recording.positions.resize(3 * recording.NumMarkers(), frames);
    std::vector<MarkerSite> sites;
    for (const std::string& name : recording.names)
      sites.push_back(*MarkerTable::Known().Find(name));
    const MarkedPerson person = MakeMarkedPerson(model, sites, RestPosture::kSeated);
    for (int t = 0; t < frames; ++t) {
      const double drink = still ? 0.0 : Drink(t, frames);
      const BodyState state = State(drink, still);
      for (int m = 0; m < recording.NumMarkers(); ++m) {
        // By name, so that both recordings have the markers where they are.
        unsigned seed = 0;
        for (const char c : recording.names[m])
          seed = (31 * seed + static_cast<unsigned>(c)) % 10007;
        const double spread = sites[m].tie == MarkerTie::kCluster ? 0.025 : 0.006;
        const Eigen::Vector3d off(std::sin(1.0 + seed), std::sin(2.0 * seed),
                                  std::sin(3.0 + seed * 5));
        const Eigen::Vector3d noise(std::sin(7.1 * t + m), std::sin(9.7 * t + 2 * m),
                                    std::sin(5.3 * t + 3 * m));
        recording.positions.block<3, 1>(3 * m, t) =
            state.WorldFromJoint(sites[m].joint) *
                Eigen::Vector3d(person.usual.segment<3>(3 * m) + spread * off) +
            2e-4 * noise;
      }
    }
    return recording;
  }
  static double Drink(int t, int frames) {
    return 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * t / (frames - 1));
  }
};

constexpr int kTrackedFrames = 90;

struct SolveMarkersTest : ::testing::Test {
  Person person;
  MarkerRecording still = person.Record(4, true), trial = person.Record(kTrackedFrames, false);

  SolvedRecording Solve(const MarkerRecording& recording) const {
    return SolveMarkers(recording, &still, person.model, {}, "trial");
  }
  std::string ErrorOf(const MarkerRecording& recording) const {
    return testing::ErrorText([&] { Solve(recording); });
  }
  // Root mean square of the distance of arm joints from the truth, mm.
  double JointError(const SolvedRecording& solved) const {
    const BodySurface surface(person.model, solved.clip.betas);
    double sum = 0.0;
    int count = 0;
    BodyState state;
    for (int t = 0; t < kTrackedFrames; ++t) {
      ForwardJoints(surface.RestJoints(), solved.clip.pose[t],
                    solved.clip.trans.col(t) - solved.report.lift_m * Eigen::Vector3d::UnitZ(),
                    state);
      const BodyState truth = person.State(Person::Drink(t, kTrackedFrames), false);
      for (const int joint : {kRightShoulder, kRightElbow, kRightWrist, kLeftElbow, kLeftWrist}) {
        sum += (state.joints.col(joint) - truth.joints.col(joint)).squaredNorm();
        ++count;
      }
    }
    return 1e3 * std::sqrt(sum / count);
  }
};

TEST_F(SolveMarkersTest, RecoversAKnownMotion) {
  const SolvedRecording solved = Solve(trial);
  EXPECT_TRUE(solved.report.converged);
  EXPECT_LT(solved.report.rms_mm, 1.5);
  EXPECT_LT(JointError(solved), 12.0);
  EXPECT_EQ(solved.clip.NumFrames(), kTrackedFrames);
  EXPECT_EQ(solved.clip.frame_rate, 50.0);
  EXPECT_NEAR(std::abs(solved.report.world.facing_rad), std::numbers::pi, 0.3);
  // Nobody marked the legs: they sit.
  EXPECT_THAT(solved.report.unmarked, ::testing::IsSupersetOf({int{kPelvis}, int{kLeftKnee}}));
  EXPECT_NEAR(solved.clip.pose[0](0, kRightKnee), 90.0 * kDegree, 1e-9);
}

TEST_F(SolveMarkersTest, PassesAGapAndPutsWrongLabelsRight) {
  const SolvedRecording plain = Solve(trial);
  MarkerRecording faulty = trial;
  const int hidden = *trial.Find("RLAR2"), a = *trial.Find("RUAR1"), b = *trial.Find("RHAN3");
  faulty.positions.block(3 * hidden, 30, 3, 25)
      .setConstant(std::numeric_limits<double>::quiet_NaN());
  faulty.positions.block(3 * a, 50, 3, 20) = trial.positions.block(3 * b, 50, 3, 20);
  faulty.positions.block(3 * b, 50, 3, 20) = trial.positions.block(3 * a, 50, 3, 20);
  for (int t = 3; t < kTrackedFrames; t += 10)
    faulty.positions(3 * *trial.Find("LUAR2"), t) += 0.12;
  const SolvedRecording solved = Solve(faulty);
  const Eigen::MatrixXd change = solved.carried - plain.carried;
  EXPECT_LT(1e3 * std::sqrt(3.0 * change.squaredNorm() / static_cast<double>(change.size())), 1.5);
  EXPECT_EQ(solved.report.faults.swaps.size(), 20u);
  EXPECT_EQ(solved.report.faults.outliers.size(), 9u);
  const auto& markers = solved.report.markers;
  const auto of = [&](const char* name) {
    return std::ranges::find_if(markers, [&](const auto& m) { return m.site.name == name; });
  };
  // The recording as it was without the faults, and it is solved alike.
  const MarkerRecording repaired = RepairedMarkers(faulty, solved);
  EXPECT_FALSE(repaired.positions.hasNaN());
  const Eigen::MatrixXd off = repaired.positions - trial.positions;
  EXPECT_LT(off.middleRows(3 * hidden, 3).colwise().norm().maxCoeff(), 3e-3);
  EXPECT_LT(off.middleRows(3 * *trial.Find("LUAR2"), 3).colwise().norm().maxCoeff(), 3e-3);
  EXPECT_EQ(off.middleRows(3 * a, 3).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(off.middleRows(3 * b, 3).cwiseAbs().maxCoeff(), 0.0);
  const SolvedRecording again = Solve(repaired);
  EXPECT_TRUE(again.report.faults.swaps.empty() && again.report.faults.outliers.empty());
  EXPECT_LT((again.carried - solved.carried).cwiseAbs().maxCoeff(), 2e-3);
  EXPECT_EQ(of("RLAR2")->longest_gap, 25);
  EXPECT_EQ(of("RUAR1")->swapped, 20);
  EXPECT_EQ(of("LUAR2")->outliers, 9);
}

TEST_F(SolveMarkersTest, DoesNotDependOnAxesOrUnits) {
  MarkerRecording other = trial;
  for (int t = 0; t < kTrackedFrames; ++t) {
    for (int m = 0; m < trial.NumMarkers(); ++m) {
      const Eigen::Vector3d x = trial.At(m, t);
      other.positions.block<3, 1>(3 * m, t) = 1e3 * Eigen::Vector3d(x.x(), x.z(), -x.y());  // y up
    }
  }
  const SolvedRecording solved = Solve(other);
  EXPECT_EQ(solved.report.world.up, UpAxis::kY);
  EXPECT_EQ(solved.report.world.scale, 1e-3);
  EXPECT_LT(JointError(solved), 12.0);
  EXPECT_LT(solved.report.rms_mm, 1.5);
}

// A cup with markers of its own that the right hand takes along.
TEST_F(SolveMarkersTest, PutsAnObjectWithMarkersIntoTheClip) {
  MarkerRecording with_cup = trial;
  Eigen::Matrix3d places;
  places << 0.04, -0.04, 0.0, 0.0, 0.01, 0.05, 0.0, 0.03, 0.07;
  SolveMarkersOptions options;
  with_cup.positions.conservativeResize(trial.positions.rows() + 9, kTrackedFrames);
  for (int k = 0; k < 3; ++k) {
    const std::string name = std::string("cup_") + "abc"[k];
    with_cup.names.push_back(name);
    with_cup.subjects.push_back("");
    for (int t = 0; t < kTrackedFrames; ++t) {
      with_cup.positions.block<3, 1>(trial.positions.rows() + 3 * k, t) =
          person.State(Person::Drink(t, kTrackedFrames), false).WorldFromJoint(kRightWrist) *
          Eigen::Vector3d(places.col(k));
    }
  }
  with_cup.positions *= 1000.0;  // millimeters that are called meters
  options.object = ObjectMarkersOf("cup_*", with_cup, "trial");
  options.object->places = places;
  const SolvedRecording solved = SolveMarkers(with_cup, &still, person.model, options, "trial");
  ASSERT_TRUE(solved.clip.object && solved.report.object);
  EXPECT_TRUE(solved.report.unused.empty());
  EXPECT_LT(solved.report.object->rms_mm, 1e-3);
  // In millimeters again, and a gap of the cup's filled.
  MarkerRecording gap = with_cup;
  gap.positions.block(trial.positions.rows() + 3, 30, 3, 20)
      .setConstant(std::numeric_limits<double>::quiet_NaN());
  const MarkerRecording repaired =
      RepairedMarkers(gap, SolveMarkers(gap, &still, person.model, options, "trial"));
  EXPECT_LT((repaired.positions - 1e-3 * with_cup.positions).bottomRows(9).cwiseAbs().maxCoeff(),
            1e-3);
  for (const int t : {0, 40, kTrackedFrames - 1}) {
    const Eigen::Isometry3d wrist =
        person.State(Person::Drink(t, kTrackedFrames), false).WorldFromJoint(kRightWrist);
    const Eigen::Isometry3d pose = solved.clip.object->Pose(t);
    EXPECT_LT(
        (pose.translation() - wrist.translation() - solved.report.lift_m * Eigen::Vector3d::UnitZ())
            .norm(),
        1e-6);
    EXPECT_LT(AngleBetween(pose.linear(), wrist.linear()), 1e-6);
  }
}

TEST_F(SolveMarkersTest, SaysWhatIsWrong) {
  MarkerRecording none = trial;
  for (std::string& name : none.names) name = "X" + name;
  EXPECT_THAT(ErrorOf(none), HasSubstr("no marker's name is known; the first is 'XSTRN'"));
  EXPECT_THAT(ErrorOf(none), HasSubstr("Nearest known names: STRN for XSTRN, "));

  // One name is known; those of the arms are others, and the nearest known ones are named.
  MarkerRecording spelled = trial;
  for (std::string& name : spelled.names) {
    if (name.starts_with("R")) name = "Right_" + name.substr(1);
    if (name.starts_with("L")) name = "left " + name.substr(1);
  }
  EXPECT_THAT(ErrorOf(spelled), HasSubstr("no frame shows at least 3 known markers; 1 known: "
                                          "STRN"));
  EXPECT_THAT(ErrorOf(spelled), HasSubstr("RSHO1 for Right_SHO1"));

  MarkerRecording empty = trial;
  empty.positions.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(ErrorOf(empty), HasSubstr("no frame shows at least 3 known markers"));

  // One marker of the person, the others not seen.
  MarkerRecording one = trial;
  one.positions.bottomRows(one.positions.rows() - 3)
      .setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(ErrorOf(one), HasSubstr("no frame shows at least 3 known markers"));

  MarkerRecording two = trial;
  two.subjects.assign(two.names.size(), "P1");
  two.subjects[4] = "P2";
  EXPECT_THAT(ErrorOf(two), HasSubstr("markers of 2 people"));

  MarkerRecording down = trial;
  for (int m = 0; m < down.NumMarkers(); ++m) {
    down.positions.middleRows(3 * m + 1, 2) *= -1.0;  // turned about x
  }
  EXPECT_THAT(ErrorOf(down), HasSubstr("upside down along z"));
  EXPECT_THAT(ErrorOf(down), HasSubstr("--up -z"));

  MarkerRecording mirrored = trial;
  for (int m = 0; m < mirrored.NumMarkers(); ++m) mirrored.positions.row(3 * m) *= -1.0;
  EXPECT_THAT(ErrorOf(mirrored), HasSubstr("is mirrored: left and right are swapped"));
  MarkerRecording exchanged = trial;
  for (std::string& name : exchanged.names) {
    if (name != "STRN") name[0] = name[0] == 'R' ? 'L' : 'R';
  }
  EXPECT_THAT(ErrorOf(exchanged), HasSubstr("is mirrored: left and right are swapped"));
}

// Combing: in a window of it both arms are over the head and as markers go the body seems upside
// down.
TEST(FindWorld, HandsOverTheHeadDoNotTurnThePersonUpsideDown) {
  const std::filesystem::path path = testing::DataFolder() / "adl/ADL003/ADL003CL1.csv.gz";
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "no " << path << " (set HOLDFAST_DATA)";
  }
  MarkerRecording combing = ReadMarkers(path);
  combing.positions = combing.positions.middleCols(80, 340).eval();
  std::vector<MarkerSite> sites;
  std::vector<int> column;
  for (int m = 0; m < combing.NumMarkers(); ++m) {
    const MarkerSite* site = MarkerTable::Known().Find(combing.names[m]);
    if (site == nullptr) continue;
    sites.push_back(*site);
    column.push_back(m);
  }
  const MarkedPerson person = MakeMarkedPerson(BodyModel::Default(), sites, RestPosture::kSeated);
  EXPECT_EQ(FindWorld(person, combing, column, std::nullopt, "combing").up, UpAxis::kZ);
  // The same hanging from the ceiling is told, not solved.
  for (int m = 0; m < combing.NumMarkers(); ++m) {
    combing.positions.middleRows(3 * m + 1, 2) *= -1.0;
  }
  EXPECT_THROW(FindWorld(person, combing, column, std::nullopt, "combing"), Error);
}

// What is not known is left out, told, and the name that may be meant with it.
TEST_F(SolveMarkersTest, NamesTheNearestOfNamesThatItDoesNotKnow) {
  MarkerRecording other = trial;
  other.names[*trial.Find("RUAR1")] = "RUPR1";
  other.names[*trial.Find("RUAR2")] = "forceplate";
  const SolvedRecording solved = Solve(other);
  ASSERT_EQ(solved.report.unused.size(), 2u);
  EXPECT_EQ(solved.report.unused[0].name, "RUPR1");
  EXPECT_EQ(solved.report.unused[0].nearest, "RUAR1");
  EXPECT_EQ(solved.report.unused[1].nearest, "");
}

// Someone of the embedded body's own shape who walks: 41 points of the skin, as perfect markers.
struct WalkTest : ::testing::Test {
  struct Point {
    const char* plug_in_gait;
    const char* cmu;
    int vertex;
  };
  static constexpr std::array<Point, 41> kPoints = {{
      {"LFHD", "LFHD", 4581},  {"LBHD", "LBHD", 1846},  {"LSHO", "LSHO", 2371},
      {"LUPA", "LUPA", 2447},  {"LELB", "LELB", 2608},  {"LFRM", "LFRM", 2786},
      {"LWRA", "LWRA", 4708},  {"LWRB", "LWRB", 4677},  {"LFIN", "LFIN", 4970},
      {"LASI", "LFWT", 3761},  {"LPSI", "LBWT", 1439},  {"LTHI", "LTHI", 1363},
      {"LKNE", "LKNE", 1143},  {"LTIB", "LSHN", 760},   {"LANK", "LANK", 492},
      {"LHEE", "LHEE", 287},   {"LTOE", "LTOE", 3532},  {"LMT5", "LMT5", 3444},
      {"RFHD", "RFHD", 9941},  {"RBHD", "RBHD", 7206},  {"RSHO", "RSHO", 7731},
      {"RUPA", "RUPA", 7807},  {"RELB", "RELB", 7968},  {"RFRM", "RFRM", 8146},
      {"RWRA", "RWRA", 10068}, {"RWRB", "RWRB", 10037}, {"RFIN", "RFIN", 10330},
      {"RASI", "RFWT", 9121},  {"RPSI", "RBWT", 6799},  {"RTHI", "RTHI", 6723},
      {"RKNE", "RKNE", 6503},  {"RTIB", "RSHN", 6120},  {"RANK", "RANK", 5852},
      {"RHEE", "RHEE", 5647},  {"RTOE", "RTOE", 8892},  {"RMT5", "RMT5", 8804},
      {"C7", "C7", 45},        {"T10", "T10", 27},      {"CLAV", "CLAV", 117},
      {"STRN", "STRN", 103},   {"RBAK", "RBAC", 7449},
  }};
  static constexpr int kFrames = 90;

  std::shared_ptr<const BodyModel> model = BodyModel::Default();
  BodySurface surface = BodySurface(model);
  std::vector<BodyState> truth = std::vector<BodyState>(kFrames);
  MarkerRecording recording;

  // A stride a second, at 30 Hz, on a bend.
  WalkTest() {
    recording.rate_hz = 30.0;
    recording.unit = "mm";
    recording.positions.resize(3 * kPoints.size(), kFrames);
    for (const Point& point : kPoints) recording.names.emplace_back(point.plug_in_gait);
    recording.subjects.assign(kPoints.size(), "");
    for (int t = 0; t < kFrames; ++t) {
      const double s = std::numbers::pi * t / 15.0, c = std::cos(s);
      JointPose pose = JointPose::Zero();
      pose.col(0) = LogSO3(ExpSO3(Eigen::Vector3d::UnitZ() * (0.01 * t + 0.08 * c)) *
                           ExpSO3(Eigen::Vector3d::UnitX() * 90.0 * kDegree));
      pose.col(kSpine1) = Eigen::Vector3d(0.03, -0.05 * c, 0.03 * std::sin(s));
      pose.col(kSpine3) = Eigen::Vector3d(0.05, -0.07 * c, 0.0);
      pose.col(kNeck) = Eigen::Vector3d(0.05 * std::sin(2 * s), 0.08 * c, 0.0);
      for (const double sign : {1.0, -1.0}) {  // left, right
        const int leg = sign > 0.0 ? kLeftHip : kRightHip;
        const int arm = sign > 0.0 ? kLeftShoulder : kRightShoulder;
        const int collar = sign > 0.0 ? kLeftCollar : kRightCollar;
        const double swing = sign * c;
        pose.col(leg) = Eigen::Vector3d(-0.05 - 0.4 * swing, 0.08 * sign, 0.04 * sign);
        pose(0, leg + 3) = 0.3 + 0.35 * std::sin(s + (sign > 0.0 ? 0.0 : std::numbers::pi));
        pose.col(leg + 6) = Eigen::Vector3d(-0.1 + 0.15 * swing, -0.1 * sign, 0.0);
        pose.col(collar) = Eigen::Vector3d(0.0, 0.03 * sign, -0.2 * sign);
        pose.col(arm) =
            Eigen::Vector3d(0.1 + 0.4 * swing, -0.3 * sign * (1.0 + 0.3 * swing), -1.05 * sign);
        pose(1, arm + 2) = -sign * (0.4 - 0.2 * swing);
      }
      const Eigen::Vector3d trans(0.02 * t * std::sin(0.01 * t), -0.035 * t, 0.9 + 0.02 * c * c);
      Forward(surface, pose, trans, truth[t]);
      for (std::size_t k = 0; k < kPoints.size(); ++k) {
        recording.positions.block<3, 1>(3 * static_cast<Eigen::Index>(k), t) =
            truth[t].vertices.col(kPoints[k].vertex);
      }
    }
  }

  MarkerRecording WithCmuNames() const {
    MarkerRecording named = recording;
    for (std::size_t k = 0; k < kPoints.size(); ++k) named.names[k] = kPoints[k].cmu;
    return named;
  }
  // Of the body's 22 joints: the root mean square over frames that is largest, mm.
  double WorstJoint(const SolvedRecording& solved) const {
    const BodySurface found(model, solved.clip.betas);
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(kNumBodyJoints);
    BodyState state;
    for (int t = 0; t < kFrames; ++t) {
      ForwardJoints(found.RestJoints(), solved.clip.pose[t],
                    solved.clip.trans.col(t) - solved.report.lift_m * Eigen::Vector3d::UnitZ(),
                    state);
      sum += (state.joints - truth[t].joints).leftCols<kNumBodyJoints>().colwise().squaredNorm();
    }
    return 1e3 * std::sqrt(sum.maxCoeff() / kFrames);
  }
};

TEST_F(WalkTest, PerfectMarkersGiveEveryJoint) {
  const SolvedRecording solved = SolveMarkers(recording, nullptr, model, {}, "walk");
  EXPECT_LT(WorstJoint(solved), 10.0);
  EXPECT_LT(solved.report.rms_mm, 2.0);
  EXPECT_TRUE(solved.report.faults.outliers.empty());
  EXPECT_TRUE(solved.report.unused.empty());
  // The same sites under CMU's names, and legs stand although those without a marker would sit.
  const SolvedRecording cmu = SolveMarkers(WithCmuNames(), nullptr, model, {}, "walk");
  EXPECT_TRUE(cmu.report.unused.empty());
  EXPECT_EQ((cmu.carried - solved.carried).cwiseAbs().maxCoeff(), 0.0);
}

// A table names what the known names lack, and replaces what it names.
TEST_F(WalkTest, TablesAddToTheKnownNames) {
  MarkerRecording named = recording;
  named.names[9] = "HIP_L";
  SolveMarkersOptions options;
  MarkerTable table;
  MarkerSite site;
  site.name = "HIP_L";
  site.vertex = kPoints[9].vertex;
  site.tie = MarkerTie::kSkin;
  site.sigma_m = 0.01;
  table.Add(site);
  site.name = "lfhd";
  site.joint = kHead;
  site.vertex = kPoints[0].vertex;
  table.Add(site);
  options.table = options.table.With(table);
  EXPECT_EQ(options.table.Find("LFHD")->vertex, kPoints[0].vertex);
  EXPECT_EQ(options.table.Find("RFHD")->vertex, -1);
  const SolvedRecording solved = SolveMarkers(named, nullptr, model, options, "walk");
  EXPECT_EQ(solved.report.markers.size(), kPoints.size());
  EXPECT_TRUE(solved.report.unused.empty());
  EXPECT_LT(WorstJoint(solved), 10.0);
}

TEST(MarkerTable, ReadsNamesAndSaysWhatIsWrong) {
  const testing::TemporaryFolder folder;
  const std::vector<int> joint_of_vertex = {0, kHead, kHead};
  const auto read = [&](const std::string& text) {
    std::ofstream(folder / "names.csv") << text;
    return MarkerTable::Read(folder / "names.csv", joint_of_vertex);
  };
  const auto error = [&](const std::string& text) {
    return testing::ErrorText([&] { read(text); });
  };
  const MarkerTable table =
      read("name,joint,vertex,cluster\nplate1,right_elbow,,forearm\ncap,,2,\n\nloose,spine3\n");
  ASSERT_EQ(table.Sites().size(), 3u);
  EXPECT_EQ(table.Find("PLATE1")->joint, kRightElbow);
  EXPECT_EQ(table.Find("plate1")->tie, MarkerTie::kCluster);
  EXPECT_EQ(table.Find("cap")->joint, kHead);
  EXPECT_EQ(table.Find("cap")->vertex, 2);
  EXPECT_EQ(table.Find("cap")->tie, MarkerTie::kSkin);
  EXPECT_EQ(table.Find("nobody"), nullptr);
  EXPECT_THAT(error("marker,bone\n"), HasSubstr("does not name the columns"));
  EXPECT_THAT(error("name,joint\na,right_elbo\n"), HasSubstr("Did you mean 'right_elbow'"));
  EXPECT_THAT(error("name,vertex\na,3\n"), HasSubstr("not a vertex of the body"));
  EXPECT_THAT(error("name,joint\na,head\nA,head\n"), HasSubstr("listed twice"));
  EXPECT_THAT(error("name,joint\n"), HasSubstr("lists no markers"));
}

}  // namespace
}  // namespace holdfast
