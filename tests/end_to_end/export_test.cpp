// SPDX-License-Identifier: MIT
// holdfast export, through the program.
#include <algorithm>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/motion/bvh.h"
#include "geometry/rotation.h"
#include "tests/support/glb_file.h"
#include "tests/support/program.h"

namespace holdfast {
namespace {

using testing::GlbFile;
using ::testing::HasSubstr;
using testing::Listing;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;

using ExportCommand = testing::ProgramTest;

// The mug beside the first frame's hand, carried along: as `fit` leaves it, without its cost.
void MakeHeldClip(const ProgramFolder& folder) {
  folder.Run("export demo_drink -o held.npz --end 20");
  Clip clip = ReadClip(folder / "held.npz");
  ObjectTrack track;
  track.name = "mug";
  track.trans = clip.trans.colwise() + Eigen::Vector3d(0.2, -0.3, 0.1);
  track.orient = Eigen::Matrix3Xd::Constant(3, clip.NumFrames(), 0.4);
  clip.object = track;
  WriteClip(clip, folder / "held.npz");
}

// Everything at once: the file shows what the body model and the object's track say, to 0.1 mm.
TEST_F(ExportCommand, GlbShowsBodyAndObject) {
  MakeHeldClip(folder);
  const auto summary = folder.Json("export held.npz -o held.glb -q");
  EXPECT_EQ(summary["frames"], 20);
  EXPECT_EQ(summary["object"], true);
  EXPECT_LE(summary["surface_error_mm"].get<double>(), 0.02);

  const GlbFile file(folder / "held.glb");
  EXPECT_THAT(file.Json()["asset"]["generator"].get<std::string>(), HasSubstr("Holdfast "));
  EXPECT_EQ(file.Json()["asset"]["extras"]["clip"], "held");
  const Clip clip = ReadClip(folder / "held.npz");
  const BodySurface surface(BodyModel::Default(), Eigen::VectorXd());
  BodyState state;
  Forward(surface, clip.pose[13], clip.trans.col(13), state);
  const Eigen::Matrix3Xd body = file.Vertices(file.Node("body"), 13);
  Eigen::Matrix3Xd z_up(3, body.cols());
  z_up << body.row(0), -body.row(2), body.row(1);
  EXPECT_LT((z_up - state.vertices).colwise().norm().maxCoeff(), 1e-4);
  const Eigen::Vector3d mug = file.Pose(13)[file.Node("mug")].translation();
  EXPECT_LT((Eigen::Vector3d(mug.x(), -mug.z(), mug.y()) - clip.object->trans.col(13)).norm(),
            1e-5);
}

// For controllers: docs/formats.md has the fields.
TEST_F(ExportCommand, ContactsAreArraysOrTables) {
  folder.Run("grasp mug -o grip.npz -q");
  const auto summary = folder.Json("export grip.npz -o contacts.npz -q");
  const auto count = summary["contact_points"].get<std::ptrdiff_t>();
  EXPECT_GT(count, 10);
  EXPECT_EQ(summary["frames_in_contact"], 1);
  const NpzReader npz(folder / "contacts.npz");
  npz.Read("contact_normal_world").RequireShape({count, 3});
  npz.Read("fingertip_pose").RequireShape({1, 2, 5, 4, 4});
  for (const double depth : npz.Read("contact_depth").AsDoubles()) {
    EXPECT_GT(depth, -0.005);
    EXPECT_LT(depth, 0.003);  // the grasp's own tolerance
  }

  folder.Run("export grip.npz -o table.csv -q");
  const auto lines = [&](const char* name) {
    const std::string text = ReadText(folder / name);
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines("table.csv"), 1 + count);
  EXPECT_EQ(lines("table_poses.csv"), 1 + 1 + 2 * 6);
  folder.Run("export grip.npz -o table.csv -q", 1);

  folder.Fails("export demo_drink -o contacts.csv", 1, "no object to touch");
}

// Of a folder that `fit`, `offhand`, `refine` or `reach` wrote.
TEST_F(ExportCommand, MetricsAreATableWithARowPerFrame) {
  MakeHeldClip(folder);
  std::filesystem::create_directory(folder / "result");
  std::filesystem::rename(folder / "held.npz", folder / "result" / "clip.npz");
  nlohmann::json metrics = {{"per_frame",
                             {{"depth_mm", std::vector<double>(20, 0.25)},
                              {"in_contact", std::vector<bool>(20, true)},
                              {"stop", std::vector<std::string>(20, "given, as \"is\"")}}}};
  metrics["per_frame"]["depth_mm"][11] = nullptr;
  std::ofstream(folder / "result" / "metrics.json") << metrics;
  folder.Run("export result -o a_metrics.csv --start 10 --end 12");
  EXPECT_EQ(ReadText(folder / "a_metrics.csv"),
            "frame,time_s,depth_mm,in_contact,stop\n"
            "0,0.000000,0.25,1,\"given, as \"\"is\"\"\"\n"
            "1,0.033333,,1,\"given, as \"\"is\"\"\"\n");

  metrics["per_frame"]["stop"].erase(3);
  std::ofstream(folder / "result" / "metrics.json") << metrics;
  folder.Fails("export result -o metrics.csv", 1,
               "20 frames, but metrics.json has a different number of values for 'stop'");
  folder.Fails("export demo_drink -o metrics.csv", 1, "no metrics.json with values per frame");
}

// What the fit was given is found again; its mesh in the result has no texture coordinates.
TEST_F(ExportCommand, GlbKeepsTheObjectsMaterialsAndTextures) {
  folder.Run("render demo_drink -o paint.png --size 32x32 -q");
  folder.Run("decimate bottle -o bottle.obj -q");
  std::string obj = "mtllib look.mtl\nvt 0 0\nvt 1 0\nvt 0.5 1\nusemtl paint\n";
  std::istringstream lines(ReadText(folder / "bottle.obj"));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string keyword, a, b, c;
    words >> keyword >> a >> b >> c;
    if (keyword == "v") obj += line + "\n";
    if (keyword == "f") obj += "f " + a + "/1 " + b + "/2 " + c + "/3\n";
  }
  std::ofstream(folder / "bottle.obj") << obj;
  std::ofstream(folder / "look.mtl") << "newmtl paint\nPr 0.25\nmap_Kd paint.png\n";
  folder.Run("fit demo_drink bottle.obj -o held --end 3 --no-report -q");

  folder.Run("export held -o held.glb -q");
  const GlbFile file(folder / "held.glb");
  const auto& json = file.Json();
  const auto& mesh = json["meshes"][json["nodes"][file.Node("bottle")]["mesh"].get<int>()];
  const auto& primitive = mesh["primitives"][0];
  const auto& material = json["materials"][primitive["material"].get<int>()];
  EXPECT_EQ(material["name"], "paint");
  EXPECT_EQ(material["pbrMetallicRoughness"]["roughnessFactor"], 0.25);
  const int texture = material["pbrMetallicRoughness"]["baseColorTexture"]["index"];
  const auto& image = json["images"][json["textures"][texture]["source"].get<int>()];
  EXPECT_EQ(image["mimeType"], "image/png");
  const auto& view = json["bufferViews"][image["bufferView"].get<int>()];
  EXPECT_EQ(view["byteLength"], std::filesystem::file_size(folder / "paint.png"));
  const auto& uv = json["accessors"][primitive["attributes"]["TEXCOORD_0"].get<int>()];
  EXPECT_EQ(uv["type"], "VEC2");

  // And through a scene: what a .glb carries may be refined, and looks the same after it.
  folder.Run("refine held.glb -o refined --hand right -q");
  folder.Run("export refined -o back.glb -q");
  const GlbFile back(folder / "back.glb");
  EXPECT_EQ(back.Json()["materials"], json["materials"]);
  const auto& kept = back.Json()["images"][0];
  EXPECT_EQ(back.Json()["bufferViews"][kept["bufferView"].get<int>()]["byteLength"],
            view["byteLength"]);
  const auto& again =
      back.Json()["meshes"][back.Json()["nodes"][back.Node("bottle")]["mesh"].get<int>()];
  EXPECT_TRUE(again["primitives"][0]["attributes"].contains("TEXCOORD_0"));

  std::filesystem::remove(folder / "bottle.obj");
  EXPECT_THAT(folder.Run("export held -o plain.glb").err, HasSubstr("bottle.obj no longer exists"));
}

TEST_F(ExportCommand, OntoWritesTheMotionOnAnotherSkeleton) {
  MakeHeldClip(folder);
  const std::string character = HOLDFAST_SOURCE_DIR "/tests/fixtures/gltf/mixamo.glb";
  const auto summary = folder.Json("export held.npz -o moved.glb -q --onto '" + character + "'");
  EXPECT_EQ(summary["skeleton"], "Mixamo");
  EXPECT_EQ(summary["frames"], 20);
  EXPECT_NO_THROW(GlbFile(folder / "moved.glb").Node("mug"));
  folder.Run("import moved.glb -o back.npz -q");
  EXPECT_EQ(ReadClip(folder / "back.npz").NumFrames(), 20);

  folder.Run("export held.npz -o a.bvh --onto moved.glb", 2);
  folder.Fails("export held.npz -o a.glb --onto nowhere.glb", 1, "nowhere.glb");
  EXPECT_THAT(RunHoldfast(folder.Path(), "export held.npz -o a.glb --onto held.npz").err,
              HasSubstr(".glb or .gltf"));
}

TEST_F(ExportCommand, BvhSaysThatItHasNoObject) {
  MakeHeldClip(folder);
  EXPECT_THAT(folder.Run("export held.npz -o a.bvh").err, HasSubstr("the object is not exported"));
  EXPECT_THAT(folder.Run("export held.npz -o b.bvh --no-object").err,
              ::testing::Not(HasSubstr("not exported")));
}

TEST_F(ExportCommand, EveryCountsWhatItWrote) {
  MakeHeldClip(folder);
  const nlohmann::json summary = folder.Json("export held.npz -o s_%02d.ply --every 8");
  EXPECT_EQ(summary["frames"], 3);
  EXPECT_EQ(summary["files"], 6);
  EXPECT_THAT(folder.Run("export held.npz -o s_%02d.ply --every 8 --force").out,
              ::testing::AllOf(HasSubstr("3 frames"), HasSubstr("6 files")));
  EXPECT_EQ(folder.Json("export held.npz -o a.usda --every 8 -q")["frames"], 3);
  folder.Fails("export held.npz -o a.glb --every 8", 2, "--every");
}

TEST_F(ExportCommand, FbxIsToldAsImportDoes) {
  std::ofstream(folder / "walk.fbx") << "Kaydara FBX Binary  \n rest";
  const char* said = "FBX is not supported: convert to or from .glb with Blender";
  EXPECT_THAT(RunHoldfast(folder.Path(), "export demo_drink -o a.fbx").err, HasSubstr(said));
  EXPECT_THAT(RunHoldfast(folder.Path(), "import walk.fbx -o a.npz").err, HasSubstr(said));
  EXPECT_THAT(RunHoldfast(folder.Path(), "doctor walk.fbx").out, HasSubstr(said));
}

TEST_F(ExportCommand, BvhComesBackThroughImport) {
  folder.Run("export demo_drink -o walk.bvh --end 30");
  EXPECT_EQ(ReadBvh(folder / "walk.bvh").NumJoints(), kNumJoints);
  folder.Run("export demo_drink -o walk.npz --end 30");
  folder.Run("import walk.bvh -o back.npz --json -q");
  const Clip before = ReadClip(folder / "walk.npz");
  const Clip after = ReadClip(folder / "back.npz");
  ASSERT_EQ(after.NumFrames(), 30);
  for (int t = 0; t < 30; ++t) {
    for (int j = 0; j < kNumJoints; ++j) {
      EXPECT_LT(AngleBetween(ExpSO3(before.pose[t].col(j)), ExpSO3(after.pose[t].col(j))), 1e-6);
    }
  }
}

TEST_F(ExportCommand, SequencesNumberBodyAndObjectByFrame) {
  MakeHeldClip(folder);
  const std::string cut = " --start 4 --end 11 --every 3 -q";
  folder.Run("export held.npz -o s_%03d.ply" + cut);
  EXPECT_EQ(Listing(folder.Path()),
            "held.npz s_004.ply s_007.ply s_010.ply s_object_004.ply s_object_007.ply "
            "s_object_010.ply ");
  const Clip clip = ReadClip(folder / "held.npz");
  const BodySurface surface(BodyModel::Default(), Eigen::VectorXd());
  BodyState state;
  Forward(surface, clip.pose[7], clip.trans.col(7), state);
  const TriangleMesh body = ReadMesh(folder / "s_007.ply");
  EXPECT_LT((body.vertices - state.vertices).colwise().norm().maxCoeff(), 1e-6);
  EXPECT_EQ(body.faces, surface.Faces());

  folder.Run("export held.npz -o o_%d.obj --no-object" + cut);
  EXPECT_THAT(Listing(folder.Path()), ::testing::Not(HasSubstr("o_object")));
  EXPECT_EQ(ReadMesh(folder / "o_10.obj").NumVertices(), body.NumVertices());
}

TEST_F(ExportCommand, UsdaTellsUpAxisAndUnits) {
  MakeHeldClip(folder);
  folder.Run("export held.npz -o a.usda --every 10 -q");
  EXPECT_THAT(ReadText(folder / "a.usda"),
              ::testing::AllOf(HasSubstr("upAxis = \"Z\""), HasSubstr("def Mesh \"object\"")));
}

TEST_F(ExportCommand, BadOutputNamesAreTheCommandLinesFault) {
  for (const char* name : {"a.fbx", "a", "a.ply", "a_%s.ply", "a_%d_%d.obj", "a_%03d.glb"}) {
    folder.Fails(std::string("export demo_drink -o ") + name, 2, name);
  }
  EXPECT_THAT(RunHoldfast(folder.Path(), "export demo_drink -o a.fbx").err,
              HasSubstr(".glb .bvh .usda .xml .npz"));
}

TEST_F(ExportCommand, NothingIsOverwrittenUnasked) {
  for (const char* name : {"a.glb", "a.bvh", "a.usda", "a.npz", "a_0003.ply"}) {
    std::ofstream(folder / name) << "mine";
    const std::string output = std::string(name) == "a_0003.ply" ? "a_%04d.ply" : name;
    const std::string arguments = "export demo_drink --end 5 -q -o " + output;
    folder.Fails(arguments, 1, "--force");
    EXPECT_EQ(ReadText(folder / name), "mine");
    folder.Run(arguments + " --force");
    EXPECT_NE(ReadText(folder / name), "mine");
  }
}

TEST_F(ExportCommand, FaultsOfTheInputAreNamed) {
  const std::pair<const char*, const char*> kFaults[] = {
      {"nowhere.npz -o a.glb", "nowhere.npz"},
      {"demo_drink -o /dev/null/folder/a.glb", "/dev/null/folder"},
      {"demo_drink -o /dev/null/a_%d.ply --end 2", "/dev/null"},
      {"demo_drink -o a.glb --start 9 --end 9", "--start"},
      {"demo_drink -o a.glb --end 100000", "99999"},
      {"demo_drink -o a.glb --object mug", "no object trajectory"}};
  for (const auto& [arguments, said] : kFaults) {
    folder.Fails(std::string("export ") + arguments, 1, said);
  }
}

// The object's mesh is gone: said, and the body is still worth having.
TEST_F(ExportCommand, AnObjectWithoutItsMeshIsToldAndLeftOut) {
  MakeHeldClip(folder);
  Clip clip = ReadClip(folder / "held.npz");
  clip.object->name = "";
  clip.object->mesh = "lost.ply";
  WriteClip(clip, folder / "held.npz");
  const ProgramResult result = folder.Run("export held.npz -o a.glb --json");
  EXPECT_THAT(result.err, HasSubstr("lost.ply"));
  EXPECT_EQ(nlohmann::json::parse(result.out)["object"], false);
  EXPECT_EQ(GlbFile(folder / "a.glb").Json()["meshes"].size(), 1u);
}

}  // namespace
}  // namespace holdfast
