// SPDX-License-Identifier: MIT
// A held mug over to other mugs, sizes and people, by the program.
#include <array>
#include <filesystem>
#include <fstream>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/embedded.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "solver/robot/contact_file.h"
#include "tests/support/program.h"
#include "tests/support/robot_files.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::ReadText;

// Ten frames of the demo with a held mug, made once.
const ProgramFolder& Held() {
  static const ProgramFolder folder;
  static const bool made =
      folder.Run("fit demo_drink mug --end 10 -o held --quiet --no-report").exit_code == 0;
  EXPECT_TRUE(made);
  return folder;
}

const std::string kTransfer = "transfer held --no-report ";

void Transfer(const std::string& arguments) { Held().Run(kTransfer + arguments); }

nlohmann::json Metrics(const std::string& folder) {
  return Held().ReadJson(folder + "/metrics.json");
}

void ExpectClean(const char* folder) {
  const nlohmann::json metrics = Metrics(folder);
  EXPECT_EQ(metrics["summary"]["frames_deeper_than_2_mm"], 0);
  EXPECT_EQ(metrics["summary"]["frames_in_contact_ratio"], 1.0);
  EXPECT_TRUE(metrics["holds"][0]["clean"]);
  EXPECT_FALSE(metrics["holds"][0]["searched"]);
}

TEST(Transfer, KeepsContactsOfAMugThatIsLargerOrSmaller) {
  for (const char* scale : {"0.8", "1.3", "1,1,1.3"}) {
    Transfer("--scale " + std::string(scale) + " -o scaled -f -q");
    ExpectClean("scaled");
    EXPECT_EQ(Metrics("scaled")["following"]["kept"], "wrists");
  }
}

TEST(Transfer, GoesToAnotherMugByShape) {
  Transfer("--scale 1.1,0.9,1.2 -o other -f -q");
  Transfer("--object other/object.ply -o to_other -f -q");
  ExpectClean("to_other");
  const nlohmann::json map = Metrics("to_other")["map"];
  EXPECT_EQ(map["method"], "registered");
  EXPECT_TRUE(map["alike"]);
  EXPECT_LT(map["residual_mm"], 1.0);
}

TEST(Transfer, GivesTheObjectToAShorterPersonWhereItWas) {
  Transfer("--betas -2,1 -o short -f -q");
  ExpectClean("short");
  const Clip clip = ReadClip(Held() / "short/clip.npz"),
             source = ReadClip(Held() / "held/clip.npz");
  EXPECT_EQ(clip.betas.size(), 2);
  EXPECT_LT((clip.object->trans - source.object->trans).colwise().norm().maxCoeff(), 0.08);
  EXPECT_LT(Metrics("short")["following"]["ankle_missed_mm"], 5.0);
}

// The embedded body, broader and deeper than any coefficients make it, its origin elsewhere.
void WriteBroadBody(const std::filesystem::path& path) {
  const NpzReader body(FindEmbedded("body/holdfast_neutral.npz").bytes, "body");
  NpzWriter writer;
  for (const std::string& name : body.Keys()) {
    const NpyMember member = body.Read(name);
    if (name != "v_template") {
      writer.Add(name, member.array);
      continue;
    }
    std::vector<double> values = member.AsDoubles();
    const double scale[] = {1.06, 1.03, 1.1}, shift[] = {0.01, 0.3, 0.02};
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = scale[i % 3] * values[i] + shift[i % 3];
    }
    const std::size_t vertices = values.size() / 3;
    writer.AddFloat64(name, {vertices, 3}, std::move(values));
  }
  writer.Write(path);
}

double SoleHeight(const Clip& clip, const std::filesystem::path& model, int t) {
  const auto body = model.empty() ? BodyModel::Default() : BodyModel::Load(model);
  BodyState state;
  Forward(BodySurface(body, clip.betas.head(0)), clip.pose[t], clip.trans.col(t), state);
  return state.vertices.row(2).minCoeff();
}

TEST(Transfer, AnotherBodyStandsOnItsOwnSoles) {
  // Of the same name as the clip's own model: what counts is its surface.
  std::filesystem::create_directory(Held() / "bodies");
  WriteBroadBody(Held() / "bodies/holdfast_neutral.npz");
  for (const char* keep : {"object", "wrists"}) {
    const std::string arguments = " --body bodies/holdfast_neutral.npz -o broad -f -q --keep ";
    Transfer(arguments + keep);
    ExpectClean("broad");
    const nlohmann::json following = Metrics("broad")["following"];
    EXPECT_NEAR(following["leg_ratio"], 1.03, 0.003);
    EXPECT_NEAR(following["hand_ratio"], 1.06, 0.01);
    const Clip clip = ReadClip(Held() / "broad/clip.npz"),
               source = ReadClip(Held() / "held/clip.npz");
    EXPECT_NEAR(SoleHeight(clip, Held() / "bodies/holdfast_neutral.npz", 4),
                SoleHeight(source, {}, 4), 2e-4);
    if (std::string(keep) != "object") continue;
    const Eigen::Matrix3Xd mug = ReadMesh(Held() / "held/object.ply").vertices;
    const double before = (source.object->Pose(4) * mug).row(2).minCoeff(),
                 after = (clip.object->Pose(4) * mug).row(2).minCoeff();
    EXPECT_NEAR(following["height_ratio"], 1.03, 0.003);
    EXPECT_NEAR(after / before, following["height_ratio"].get<double>(), 0.004);
  }
}

TEST(Transfer, SaysHowFarTheMapStretchesForAnotherKind) {
  EXPECT_THAT(testing::RunHoldfast(Held().Path(), kTransfer + "--object hammer -o hammer -f").err,
              HasSubstr("differs much in shape from mug: the map stretches by up to"));
}

TEST(Transfer, VariantsGoOnWhereTheyWereStoppedOnAnyNumberOfThreads) {
  Transfer("--variants 4 -o four -q --threads 2");
  Transfer("--variants 2 -o more -q --threads 1");
  const std::string two = ReadText(Held() / "more/manifest.jsonl");
  Transfer("--variants 4 -o more -q --threads 1");
  const std::string four = ReadText(Held() / "more/manifest.jsonl");
  EXPECT_EQ(four.substr(0, two.size()), two);
  EXPECT_EQ(four, ReadText(Held() / "four/manifest.jsonl"));
  EXPECT_EQ(testing::Listing(Held() / "more"), testing::Listing(Held() / "four"));
  std::istringstream lines(four);
  int kept = 0;
  for (std::string text; std::getline(lines, text);) {
    const nlohmann::json line = nlohmann::json::parse(text);
    if (!line.value("kept", false)) continue;
    ++kept;
    EXPECT_LE(line["deepest_mm"], 2.0);
    EXPECT_EQ(line["in_contact_ratio"], 1.0);
    const std::string file = line["file"];
    EXPECT_EQ(ReadText(Held() / "more" / file), ReadText(Held() / "four" / file)) << file;
  }
  EXPECT_EQ(kept, 4);
  Held().Fails(kTransfer + "--variants 4 -o more -q --seed 9", 1, "another clip, options");
}

// A robot whose two fingers do not bend keeps no contact: it is written, and told.
TEST(Transfer, ARobotThatKeepsNoContactIsExitCodeThree) {
  std::string stiff = testing::BoxHand{.fingers = 2}.Urdf();
  for (std::size_t at = 0; (at = stiff.find("upper=\"1.6\"", at)) != std::string::npos; ++at) {
    stiff.replace(at, 11, "upper=\"-0.0\"");
  }
  std::ofstream(Held() / "stiff.urdf") << stiff;
  const ProgramResult result = Held().Run("transfer held --robot stiff.urdf -o stiff -f", 3);
  EXPECT_THAT(result.err, HasSubstr("warning: contact is lost at "));
  EXPECT_THAT(result.err, HasSubstr("less than 50 % of the contacts are kept"));
  EXPECT_LT(Metrics("stiff")["transfer"]["contacts_kept_ratio"], 0.5);
  for (const char* name :
       {"robot.npz", "robot.csv", "motion_v1.npz", "object.obj", "scene.xml", "report.html"}) {
    EXPECT_TRUE(std::filesystem::exists(Held() / "stiff" / name)) << name;
  }
  testing::BoxHand{.coupled = true}.Write(Held() / "bends.urdf");
  Held().Run("transfer held --robot bends.urdf -o bends -f -q");
  EXPECT_GE(Metrics("bends")["transfer"]["contacts_kept_ratio"], 0.5);
}

Eigen::Vector3d Vector(const nlohmann::json& values) {
  return Eigen::Vector3d(values.get<std::array<double, 3>>().data());
}

// The file that a transfer writes gives the same transfer; a contact that is moved takes the finger
// with it.
TEST(Transfer, KeepsContactsOfAFile) {
  testing::BoxHand{}.Write(Held() / "right.urdf");
  Held().Run("transfer held --robot right.urdf -o first -f -q");
  const nlohmann::json written = Held().ReadJson("first/contacts.json");
  ASSERT_GE(written["contacts"].size(), 3u);
#ifdef HOLDFAST_HAS_PLAYER
  EXPECT_THAT(ReadText(Held() / "first/report.html"),
              HasSubstr("transfer held --robot right.urdf --contacts contacts.json -o edited"));
#endif
  Held().Run("transfer held --robot right.urdf --contacts first/contacts.json -o again -f -q");
  const nlohmann::json read = Held().ReadJson("again/contacts.json")["contacts"];
  ASSERT_EQ(read.size(), written["contacts"].size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i]["part"], written["contacts"][i]["part"]);
    EXPECT_EQ(read[i]["frames"], written["contacts"][i]["frames"]);
    EXPECT_LT((Vector(read[i]["point"]) - Vector(written["contacts"][i]["point"])).norm(), 1e-6);
  }
  EXPECT_NEAR(Metrics("again")["transfer"]["contact_distance_mm"],
              static_cast<double>(Metrics("first")["transfer"]["contact_distance_mm"]), 0.5);

  // Half a centimeter down, without a normal; the other contacts are left out, but for the thumb's.
  nlohmann::json edited = written;
  edited["contacts"].clear();
  Eigen::Vector3d wanted = Eigen::Vector3d::Zero();
  for (nlohmann::json contact : written["contacts"]) {
    const std::string part = contact["part"];
    if (part.starts_with("thumb")) edited["contacts"].push_back(contact);
    if (part != "ring3") continue;
    contact["point"][2] = static_cast<double>(contact["point"][2]) - 0.005;
    contact.erase("normal");
    edited["contacts"].push_back(contact);
    wanted = Vector(contact["point"]);
  }
  std::ofstream(Held() / "edited.json") << edited;
  Held().Run("transfer held --robot right.urdf --contacts edited.json -o moved -f -q");
  const NpzReader moved(Held() / "moved/robot.npz");
  const auto parts = moved.Read("contact_part").AsIntegers();
  EXPECT_EQ(std::set<int>(parts.begin(), parts.end()).count(ParseHandPart("ring3")), 1u);
  EXPECT_LE(Metrics("moved")["transfer"]["contact_distance_mm"], 5.0);
  const nlohmann::json used = Held().ReadJson("moved/contacts.json");
  for (const nlohmann::json& contact : used["contacts"]) {
    if (contact["part"] != "ring3") continue;
    EXPECT_LT((Vector(contact["point"]) - wanted).norm(), 0.003);
  }

  const auto refused = [](const nlohmann::json& file, const char* why) {
    std::ofstream(Held() / "bad.json") << file;
    Held().Fails("transfer held --robot right.urdf --contacts bad.json -o x", 1, why);
  };
  refused({{"schema", "other"}}, "is not a file of contacts");
  const auto with = [&](const char* key, const nlohmann::json& value) {
    nlohmann::json file = written;
    file["contacts"][0][key] = value;
    return file;
  };
  refused(with("part", "toe1"), "contact 0: has the unknown part 'toe1'");
  refused(with("frames", {5, 1000}), "within 0 to 9");
  refused(with("frames", "all"), "is damaged");
  refused(with("point", {0.0, 0.0, 3.0}), "cm from the object's surface");
  refused(with("normal", {0.0, 0.0, 0.0}), "has no direction");
  nlohmann::json none = written;
  none["contacts"].clear();
  refused(none, "has no contact");
  none["hand"] = "left";
  refused(none, "has contacts of a left hand");
  nlohmann::json twice = written;
  twice["contacts"].push_back(twice["contacts"][0]);
  refused(twice, "has two contacts of");
}

// Each hand is solved as if it were alone; the scene has both.
TEST(Transfer, TwoRobotsTakeBothHands) {
  testing::BoxHand{}.Write(Held() / "right.urdf");
  testing::BoxHand{.left = true}.Write(Held() / "left.urdf");
  Held().Run("fit demo_inspect bowl --hand both --end 12 -o both -f -q --no-report");
  Held().Run("transfer both --robot left.urdf right.urdf -o two -f -q");
  const nlohmann::json hands = Metrics("two")["hands"];
  for (const std::string side : {"right", "left"}) {
    const std::string alone = "alone_" + side;
    Held().Run("transfer both --hand " + side + " --robot " + side + ".urdf -o " + alone +
               " -f -q");
    EXPECT_EQ(ReadText(Held() / "two" / side / "robot.npz"),
              ReadText(Held() / alone / "robot.npz"));
    EXPECT_EQ(hands[side]["transfer"], Metrics(alone)["transfer"]);
    EXPECT_GE(hands[side]["transfer"]["contacts_kept_ratio"], 0.5);
    EXPECT_TRUE(std::filesystem::exists(Held() / "two" / side / "sheet.png"));
  }
  const std::string scene = ReadText(Held() / "two/scene.xml");
  for (const char* name : {"\"right_wrist_target\"", "\"left_wrist_target\"", "\"right_palm\"",
                           "\"left_palm\"", "\"left_bend_digit_0_1\""}) {
    EXPECT_THAT(scene, HasSubstr(name));
  }
  EXPECT_THAT(ReadText(Held() / "two/report.html"), HasSubstr("left/report.html"));

  Held().Fails("transfer both --robot right.urdf right.urdf -o x", 1, "are both right hands");
  Held().Fails("transfer both --robot right.urdf left.urdf --hand left -o x", 1, "Leave it out");
  Held().Fails("transfer both --robot right.urdf left.urdf --correspondence c.csv -o x", 1,
               "one robot");
  Held().Fails("transfer held --robot right.urdf left.urdf -o x", 1,
               "its left hand never touches the object");
}

TEST(Transfer, RefusesWhatIsNone) {
  const auto refused = [](const std::string& arguments, int exit_code, const char* why) {
    Held().Fails(kTransfer + arguments, exit_code, why);
  };
  refused("-o x", 2, "Give a target");
  refused("--scale 0 -o x", 2, "--scale");
  refused("--scale -1 -o x", 2, "--scale");
  refused("--scale nan -o x", 2, "--scale");
  refused("--scale 1,2 -o x", 1, "two factors");
  refused("--scale 1e9 -o x", 2, "--scale");
  refused("--scale 15 -o x", 3, "no hand touches");
  refused("--object none.obj -o x", 1, "none.obj");
  refused("--object mug --object-scale 1000 -o x", 1, "mug");
  refused("--object mug --map none.txt -o x", 1, "none.txt");
  refused("--betas 1e9 -o x", 1, "--betas");
  std::ofstream(Held() / "map.txt") << "1\n2\n";
  refused("--object mug --map map.txt -o x", 1, "has 2 rows");
  Held().Fails("transfer demo_drink --scale 1.1 -o x", 1, "has no object");
}

}  // namespace
}  // namespace holdfast
