// SPDX-License-Identifier: MIT
// `solve` through the program, on recordings of people.
#include <cmath>
#include <fstream>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/markers/c3d.h"
#include "solver/markers/marked_person.h"
#include "tests/support/data_folder.h"
#include "tests/support/program.h"

namespace holdfast {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing::ProgramResult;

using SolveCommand = testing::ProgramTest;

TEST_F(SolveCommand, SolvesSomeoneWhoDrinks) {
  const std::filesystem::path data = testing::DataFolder() / "adl" / "ADL009";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no recordings in " << data;
  const nlohmann::json summary =
      folder.Json("solve '" + (data / "ADL009DR1.csv.gz").string() + "' --static '" +
                  (data / "ADL009_static.csv.gz").string() + "' -o drinks -q");
  EXPECT_LT(summary["rms_mm"].get<double>(), 4.0);
  EXPECT_EQ(summary["world"]["up"], "z");
  EXPECT_NEAR(summary["world"]["facing_deg"].get<double>(), 0.0, 20.0);  // turned by 180 degrees
  EXPECT_THAT(summary["unmarked_joints"], Contains("left_knee"));
  const Clip clip = ReadClip(folder / "drinks/clip.npz");
  EXPECT_EQ(clip.frame_rate, 100.0);
  EXPECT_EQ(clip.NumFrames(), summary["frames"].get<int>());
  EXPECT_EQ(summary["head"]["hand_deep_frames"], 0);

  const nlohmann::json drink =
      folder.Json("fit drinks mug -o held --drink --start 100 --end 640 --no-report -q")["drink"];
  EXPECT_EQ(drink["hand"], "right");
  EXPECT_LT(drink["rim_from_mouth_mm"].get<double>(), 20.0);
  EXPECT_GT(drink["tilt_deg"].get<double>(), 60.0);
  EXPECT_LT(drink["lean_on_table_deg"].get<double>(), 2.0);

  const std::string render = "render drinks --frame 300 --size 160x120 -q -o ";
  folder.Run(render + "bare.png");
  folder.Run(render + "marked.png --markers drinks");
  EXPECT_NE(ReadFile(folder / "bare.png"), ReadFile(folder / "marked.png"));
  folder.Fails(render + "wrong.png --markers held", 1,
               "is not a folder written by 'holdfast solve'");
}

TEST_F(SolveCommand, SaysWhichNamesItDoesNotKnow) {
  std::ofstream(folder / "two.csv") << "Trajectories\n100\n,,P:RLEB,,,P:RWRX,,\n"
                                       "Frame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n"
                                       "1,0,1,2,3,40,50,60\n2,0,1,2,3,40,50,60\n";
  const ProgramResult result = folder.Run("solve two.csv -o out", 1);
  EXPECT_THAT(result.err, HasSubstr("two.csv: no marker's name is known; the first is 'RLEB'"));
  EXPECT_THAT(result.err, HasSubstr("--markers"));
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

constexpr const char* kPillow =
    "name,x,y,z\npillow_top,0.1502,0.0760,0.0950\npillow_left,-0.1502,-0.1160,0.0950\n"
    "pillow_right,0.1502,-0.1143,0.0950\n";

// The first of twenty-one touches of a pillow, which stays where it is.
TEST_F(SolveCommand, SolvesAHandThatTouchesAPillow) {
  const std::filesystem::path data = testing::DataFolder() / "markers" / "dfki_pillow";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no recording in " << data;
  const std::string recording = ReadGzipText(data / "recording.tsv.gz");
  std::size_t end = 0;
  for (int line = 0; line < 12 + 500; ++line) end = recording.find('\n', end) + 1;
  std::ofstream(folder / "touch.tsv", std::ios::binary) << recording.substr(0, end);
  std::ofstream(folder / "pillow.csv") << kPillow;
  const nlohmann::json summary = folder.Json(
      "solve touch.tsv -o solved -q --object-markers pillow.csv "
      "--object '" +
      (data / "pillow_small.stl").string() + "'");
  EXPECT_LT(summary["rms_mm"].get<double>(), 3.0);
  EXPECT_LT(summary["object"]["rms_mm"].get<double>(), 1.0);
  EXPECT_LT(summary["object"]["places_from_table_rms_mm"].get<double>(), 1.0);
  EXPECT_TRUE(summary["object"]["filled_frames"].empty());
  const Clip clip = ReadClip(folder / "solved/clip.npz");
  ASSERT_TRUE(clip.object);
  EXPECT_EQ(clip.object->mesh, "object.ply");
  EXPECT_EQ(clip.object->name, "pillow_small");
  EXPECT_LT((clip.object->trans.colwise() - clip.object->trans.col(0)).colwise().norm().maxCoeff(),
            0.015);

  const nlohmann::json clean = folder.Json("refine solved -o clean -q");
  ASSERT_EQ(clean["touches"].size(), 1u);
  EXPECT_LT(clean["touches"][0]["begin"], 300);
  EXPECT_GT(clean["touches"][0]["end"], 390);
  EXPECT_TRUE(clean["holds"].empty());
  EXPECT_GT(clean["before"]["frames_deeper_than_2_mm"], 60);
  EXPECT_EQ(clean["after"]["frames_deeper_than_2_mm"], 0);
}

TEST_F(SolveCommand, SaysWhatAnObjectLacks) {
  std::ofstream(folder / "one.csv") << "Trajectories\n100\n,,STRN,,,cup_a,,,cup_b,,\n"
                                       "Frame,Sub Frame,X,Y,Z,X,Y,Z,X,Y,Z\n,,mm,mm,mm\n"
                                       "1,0,1,2,3,40,50,60,,,\n2,0,1,2,3,40,50,60,,,\n";
  std::ofstream(folder / "cup.csv") << "name,x,y,z\ncup_x,0,0,0\n";
  const std::map<std::string, std::string> faults = {
      {"--object mug", "--object: has no marker positions"},
      {"--object mug --object-markers 'cup_*'", "--object-markers: has names without positions"},
      {"--object-markers cup.csv", "one.csv: has no marker 'cup_x' of the object. Did you mean"},
      {"--object-markers 'mug_*'",
       "no marker's name matches 'mug_*'. Its markers are STRN cup_a cup_b"},
      {"--object-markers nowhere.csv", "nowhere.csv: cannot be read"},
      // Of the person there is one marker.
      {"--object-markers 'cup_*'", "no frame shows at least 3 known markers"}};
  for (const auto& [options, fault] : faults) {
    folder.Fails("solve one.csv -o out " + options, 1, fault);
  }
}

// The markers of a set over a person of the embedded body who stands in the T-pose.
MarkerRecording StandingMarkers(const std::vector<std::string>& names) {
  MarkerRecording recording;
  SetMarkerNames(names, "", recording);
  recording.rate_hz = 50.0;
  std::vector<MarkerSite> sites;
  for (const std::string& name : recording.names) sites.push_back(*MarkerTable::Known().Find(name));
  const MarkedPerson person = MakeMarkedPerson(BodyModel::Default(), sites, RestPosture::kStanding);
  recording.positions.resize(3 * recording.NumMarkers(), 10);
  for (int m = 0; m < recording.NumMarkers(); ++m) {
    const Eigen::Vector3d x = person.bent.col(m);
    recording.positions.middleRows<3>(3 * m).colwise() =
        Eigen::Vector3d(x.x(), -x.z(), x.y() + 1.3);
  }
  return recording;
}

const std::vector<std::string> kStanding = {"LFHD", "RFHD", "LBHD", "RBHD", "C7",   "T10",  "CLAV",
                                            "STRN", "LSHO", "RSHO", "LELB", "RELB", "LWRA", "LWRB",
                                            "RWRA", "RWRB", "LASI", "RASI", "LPSI", "RPSI"};

TEST_F(SolveCommand, WarnsOfNamesLeftOutAndBytesThatAreNotUtf8) {
  MarkerRecording recording = StandingMarkers(kStanding);
  recording.names[5] =
      "h\xfc"
      "fte";
  WriteC3d(recording, folder / "w\xe4lk.c3d");
  const ProgramResult result = folder.Run("solve w\xe4lk.c3d -o out --json");
  EXPECT_THAT(result.err, HasSubstr("names that are not UTF-8 are read as Latin-1: h\u00fc"
                                    "fte"));
  EXPECT_THAT(result.err, HasSubstr("warning: w\xe4lk.c3d: 1 of 20 markers are ignored because "
                                    "their names are unknown: h\u00fc"
                                    "fte. Add them with --markers"));
  const nlohmann::json summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary["options"]["recording"], "w\u00e4lk.c3d");
  EXPECT_EQ(summary["unused_names"], nlohmann::json::array({"h\u00fc"
                                                            "fte"}));
  // The table adds the one name; the others are known as before.
  std::ofstream(folder / "names.csv") << "name,joint,vertex,cluster\nh\u00fc"
                                         "fte,spine2,,\n";
  const ProgramResult added = folder.Run("solve w\xe4lk.c3d -o out -f --json --markers names.csv");
  EXPECT_EQ(nlohmann::json::parse(added.out)["markers"].size(), 20u);
  EXPECT_EQ(added.err.find("warning"), std::string::npos) << added.err;
}

// Labels at random: no body fits, the result is there to be looked at and the exit code is 3.
TEST_F(SolveCommand, FailsItsCheckWhereTheBodyIsFarFromTheMarkers) {
  MarkerRecording recording = StandingMarkers(kStanding);
  for (int m = 0; m < recording.NumMarkers(); ++m) {
    for (int t = 0; t < recording.NumFrames(); ++t) {
      for (int c = 0; c < 3; ++c) {
        recording.positions(3 * m + c, t) += 0.12 * std::sin(1.0 + 7.0 * t + 3.0 * m + 5.0 * c);
      }
    }
  }
  WriteC3d(recording, folder / "shaken.c3d");
  const ProgramResult result = folder.Run("solve shaken.c3d -o out --json", 3);
  EXPECT_THAT(result.err, HasSubstr("marker residual is "));
  EXPECT_GT(nlohmann::json::parse(result.out)["rms_mm"].get<double>(), 30.0);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/clip.npz"));
}

}  // namespace
}  // namespace holdfast
