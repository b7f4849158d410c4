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
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using testing::GlbFile;
using ::testing::HasSubstr;
using testing::Listing;
using testing::ProgramResult;
using testing::RunHoldfast;
using testing::TemporaryFolder;

// The mug beside the first frame's hand, carried along: as `fit` leaves it, without its cost.
void MakeHeldClip(const TemporaryFolder& folder) {
  ASSERT_EQ(RunHoldfast(folder.Path(), "export demo_drink -o held.npz --end 20").exit_code, 0);
  Clip clip = ReadClip(folder / "held.npz");
  ObjectTrack track;
  track.name = "mug";
  track.trans = clip.trans.colwise() + Eigen::Vector3d(0.2, -0.3, 0.1);
  track.orient = Eigen::Matrix3Xd::Constant(3, clip.NumFrames(), 0.4);
  clip.object = track;
  WriteClip(clip, folder / "held.npz");
}

// Everything at once: the file shows what the body model and the object's track say, to 0.1 mm.
TEST(ExportCommand, GlbShowsBodyAndObject) {
  const TemporaryFolder folder;
  MakeHeldClip(folder);
  const ProgramResult result = RunHoldfast(folder.Path(), "export held.npz -o held.glb --json -q");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto summary = nlohmann::json::parse(result.out);
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
TEST(ExportCommand, ContactsAreArraysOrTables) {
  const TemporaryFolder folder;
  ASSERT_EQ(RunHoldfast(folder.Path(), "grasp mug -o grip.npz -q").exit_code, 0);
  const ProgramResult result =
      RunHoldfast(folder.Path(), "export grip.npz -o contacts.npz --json -q");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto summary = nlohmann::json::parse(result.out);
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

  ASSERT_EQ(RunHoldfast(folder.Path(), "export grip.npz -o table.csv -q").exit_code, 0);
  const auto lines = [&](const char* name) {
    const std::string text = testing::ReadText(folder / name);
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines("table.csv"), 1 + count);
  EXPECT_EQ(lines("table_poses.csv"), 1 + 1 + 2 * 6);
  EXPECT_EQ(RunHoldfast(folder.Path(), "export grip.npz -o table.csv -q").exit_code, 1);

  const ProgramResult none = RunHoldfast(folder.Path(), "export demo_drink -o contacts.csv");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.err, HasSubstr("no object to touch"));
}

// Of a folder that `fit`, `offhand`, `refine` or `reach` wrote.
TEST(ExportCommand, MetricsAreATableWithARowPerFrame) {
  const TemporaryFolder folder;
  MakeHeldClip(folder);
  std::filesystem::create_directory(folder / "result");
  std::filesystem::rename(folder / "held.npz", folder / "result" / "clip.npz");
  nlohmann::json metrics = {{"per_frame",
                             {{"depth_mm", std::vector<double>(20, 0.25)},
                              {"in_contact", std::vector<bool>(20, true)},
                              {"stop", std::vector<std::string>(20, "given, as \"is\"")}}}};
  metrics["per_frame"]["depth_mm"][11] = nullptr;
  std::ofstream(folder / "result" / "metrics.json") << metrics;
  const ProgramResult result =
      RunHoldfast(folder.Path(), "export result -o a_metrics.csv --start 10 --end 12");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(testing::ReadText(folder / "a_metrics.csv"),
            "frame,time_s,depth_mm,in_contact,stop\n"
            "0,0.000000,0.25,1,\"given, as \"\"is\"\"\"\n"
            "1,0.033333,,1,\"given, as \"\"is\"\"\"\n");

  metrics["per_frame"]["stop"].erase(3);
  std::ofstream(folder / "result" / "metrics.json") << metrics;
  const ProgramResult damaged = RunHoldfast(folder.Path(), "export result -o metrics.csv");
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_THAT(damaged.err,
              HasSubstr("20 frames, but metrics.json has a different number of values for 'stop'"));
  const ProgramResult none = RunHoldfast(folder.Path(), "export demo_drink -o metrics.csv");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.err, HasSubstr("no metrics.json with values per frame"));
}

// What the fit was given is found again; its mesh in the result has no texture coordinates.
TEST(ExportCommand, GlbKeepsTheObjectsMaterialsAndTextures) {
  const TemporaryFolder folder;
  ASSERT_EQ(RunHoldfast(folder.Path(), "render demo_drink -o paint.png --size 32x32 -q").exit_code,
            0);
  ASSERT_EQ(RunHoldfast(folder.Path(), "decimate bottle -o bottle.obj -q").exit_code, 0);
  std::string obj = "mtllib look.mtl\nvt 0 0\nvt 1 0\nvt 0.5 1\nusemtl paint\n";
  std::istringstream lines(testing::ReadText(folder / "bottle.obj"));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string keyword, a, b, c;
    words >> keyword >> a >> b >> c;
    if (keyword == "v") obj += line + "\n";
    if (keyword == "f") obj += "f " + a + "/1 " + b + "/2 " + c + "/3\n";
  }
  std::ofstream(folder / "bottle.obj") << obj;
  std::ofstream(folder / "look.mtl") << "newmtl paint\nPr 0.25\nmap_Kd paint.png\n";
  const ProgramResult fit =
      RunHoldfast(folder.Path(), "fit demo_drink bottle.obj -o held --end 3 --no-report -q");
  ASSERT_EQ(fit.exit_code, 0) << fit.err;

  ASSERT_EQ(RunHoldfast(folder.Path(), "export held -o held.glb -q").exit_code, 0);
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
  ASSERT_EQ(RunHoldfast(folder.Path(), "refine held.glb -o refined --hand right -q").exit_code, 0);
  ASSERT_EQ(RunHoldfast(folder.Path(), "export refined -o back.glb -q").exit_code, 0);
  const GlbFile back(folder / "back.glb");
  EXPECT_EQ(back.Json()["materials"], json["materials"]);
  const auto& kept = back.Json()["images"][0];
  EXPECT_EQ(back.Json()["bufferViews"][kept["bufferView"].get<int>()]["byteLength"],
            view["byteLength"]);
  const auto& again =
      back.Json()["meshes"][back.Json()["nodes"][back.Node("bottle")]["mesh"].get<int>()];
  EXPECT_TRUE(again["primitives"][0]["attributes"].contains("TEXCOORD_0"));

  std::filesystem::remove(folder / "bottle.obj");
  const ProgramResult gone = RunHoldfast(folder.Path(), "export held -o plain.glb");
  EXPECT_EQ(gone.exit_code, 0);
  EXPECT_THAT(gone.err, HasSubstr("bottle.obj no longer exists"));
}

TEST(ExportCommand, OntoWritesTheMotionOnAnotherSkeleton) {
  const TemporaryFolder folder;
  MakeHeldClip(folder);
  const std::string character = HOLDFAST_SOURCE_DIR "/tests/fixtures/gltf/mixamo.glb";
  const ProgramResult result = RunHoldfast(
      folder.Path(), "export held.npz -o moved.glb --json -q --onto '" + character + "'");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary["skeleton"], "Mixamo");
  EXPECT_EQ(summary["frames"], 20);
  EXPECT_NO_THROW(GlbFile(folder / "moved.glb").Node("mug"));
  const ProgramResult back = RunHoldfast(folder.Path(), "import moved.glb -o back.npz -q");
  EXPECT_EQ(back.exit_code, 0) << back.err;
  EXPECT_EQ(ReadClip(folder / "back.npz").NumFrames(), 20);

  EXPECT_EQ(RunHoldfast(folder.Path(), "export held.npz -o a.bvh --onto moved.glb").exit_code, 2);
  const ProgramResult none =
      RunHoldfast(folder.Path(), "export held.npz -o a.glb --onto nowhere.glb");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.err, HasSubstr("nowhere.glb"));
  EXPECT_THAT(RunHoldfast(folder.Path(), "export held.npz -o a.glb --onto held.npz").err,
              HasSubstr(".glb or .gltf"));
}

TEST(ExportCommand, BvhSaysThatItHasNoObject) {
  const TemporaryFolder folder;
  MakeHeldClip(folder);
  const ProgramResult with = RunHoldfast(folder.Path(), "export held.npz -o a.bvh");
  EXPECT_EQ(with.exit_code, 0);
  EXPECT_THAT(with.err, HasSubstr("the object is not exported"));
  const ProgramResult without = RunHoldfast(folder.Path(), "export held.npz -o b.bvh --no-object");
  EXPECT_THAT(without.err, ::testing::Not(HasSubstr("not exported")));
}

TEST(ExportCommand, EveryCountsWhatItWrote) {
  const TemporaryFolder folder;
  MakeHeldClip(folder);
  const ProgramResult result =
      RunHoldfast(folder.Path(), "export held.npz -o s_%02d.ply --every 8 --json");
  const auto summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary["frames"], 3);
  EXPECT_EQ(summary["files"], 6);
  const ProgramResult text =
      RunHoldfast(folder.Path(), "export held.npz -o s_%02d.ply --every 8 --force");
  EXPECT_THAT(text.out, HasSubstr("3 frames"));
  EXPECT_THAT(text.out, HasSubstr("6 files"));
  const ProgramResult usda =
      RunHoldfast(folder.Path(), "export held.npz -o a.usda --every 8 --json -q");
  EXPECT_EQ(nlohmann::json::parse(usda.out)["frames"], 3);
  const ProgramResult glb = RunHoldfast(folder.Path(), "export held.npz -o a.glb --every 8");
  EXPECT_EQ(glb.exit_code, 2);
  EXPECT_THAT(glb.err, HasSubstr("--every"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.glb"));
}

TEST(ExportCommand, FbxIsToldAsImportDoes) {
  const TemporaryFolder folder;
  std::ofstream(folder / "walk.fbx") << "Kaydara FBX Binary  \n rest";
  const char* said = "FBX is not supported: convert to or from .glb with Blender";
  EXPECT_THAT(RunHoldfast(folder.Path(), "export demo_drink -o a.fbx").err, HasSubstr(said));
  EXPECT_THAT(RunHoldfast(folder.Path(), "import walk.fbx -o a.npz").err, HasSubstr(said));
  EXPECT_THAT(RunHoldfast(folder.Path(), "doctor walk.fbx").out, HasSubstr(said));
}

TEST(ExportCommand, BvhComesBackThroughImport) {
  const TemporaryFolder folder;
  const ProgramResult out = RunHoldfast(folder.Path(), "export demo_drink -o walk.bvh --end 30");
  ASSERT_EQ(out.exit_code, 0) << out.err;
  EXPECT_EQ(ReadBvh(folder / "walk.bvh").NumJoints(), kNumJoints);
  ASSERT_EQ(RunHoldfast(folder.Path(), "export demo_drink -o walk.npz --end 30").exit_code, 0);
  const ProgramResult in = RunHoldfast(folder.Path(), "import walk.bvh -o back.npz --json -q");
  ASSERT_EQ(in.exit_code, 0) << in.err;
  const Clip before = ReadClip(folder / "walk.npz");
  const Clip after = ReadClip(folder / "back.npz");
  ASSERT_EQ(after.NumFrames(), 30);
  for (int t = 0; t < 30; ++t) {
    for (int j = 0; j < kNumJoints; ++j) {
      EXPECT_LT(AngleBetween(ExpSO3(before.pose[t].col(j)), ExpSO3(after.pose[t].col(j))), 1e-6);
    }
  }
}

TEST(ExportCommand, SequencesNumberBodyAndObjectByFrame) {
  const TemporaryFolder folder;
  MakeHeldClip(folder);
  const std::string cut = " --start 4 --end 11 --every 3 -q";
  ASSERT_EQ(RunHoldfast(folder.Path(), "export held.npz -o s_%03d.ply" + cut).exit_code, 0);
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

  ASSERT_EQ(RunHoldfast(folder.Path(), "export held.npz -o o_%d.obj --no-object" + cut).exit_code,
            0);
  EXPECT_THAT(Listing(folder.Path()), ::testing::Not(HasSubstr("o_object")));
  EXPECT_EQ(ReadMesh(folder / "o_10.obj").NumVertices(), body.NumVertices());
}

TEST(ExportCommand, UsdaTellsUpAxisAndUnits) {
  const TemporaryFolder folder;
  MakeHeldClip(folder);
  ASSERT_EQ(RunHoldfast(folder.Path(), "export held.npz -o a.usda --every 10 -q").exit_code, 0);
  const std::string text = testing::ReadText(folder / "a.usda");
  EXPECT_THAT(text, HasSubstr("upAxis = \"Z\""));
  EXPECT_THAT(text, HasSubstr("def Mesh \"object\""));
}

TEST(ExportCommand, BadOutputNamesAreTheCommandLinesFault) {
  const TemporaryFolder folder;
  for (const char* name : {"a.fbx", "a", "a.ply", "a_%s.ply", "a_%d_%d.obj", "a_%03d.glb"}) {
    const ProgramResult result =
        RunHoldfast(folder.Path(), std::string("export demo_drink -o ") + name);
    EXPECT_EQ(result.exit_code, 2) << name;
    EXPECT_THAT(result.err, HasSubstr(name));
    EXPECT_EQ(Listing(folder.Path()), "") << name;
  }
  const ProgramResult unknown = RunHoldfast(folder.Path(), "export demo_drink -o a.fbx");
  EXPECT_THAT(unknown.err, HasSubstr(".glb .bvh .usda .xml .npz"));
}

TEST(ExportCommand, NothingIsOverwrittenUnasked) {
  const TemporaryFolder folder;
  for (const char* name : {"a.glb", "a.bvh", "a.usda", "a.npz", "a_0003.ply"}) {
    std::ofstream(folder / name) << "mine";
    const std::string output = std::string(name) == "a_0003.ply" ? "a_%04d.ply" : name;
    const std::string arguments = "export demo_drink --end 5 -q -o " + output;
    const ProgramResult refused = RunHoldfast(folder.Path(), arguments);
    EXPECT_EQ(refused.exit_code, 1) << name;
    EXPECT_THAT(refused.err, HasSubstr("--force"));
    EXPECT_EQ(testing::ReadText(folder / name), "mine");
    EXPECT_EQ(RunHoldfast(folder.Path(), arguments + " --force").exit_code, 0) << name;
    EXPECT_NE(testing::ReadText(folder / name), "mine");
  }
}

TEST(ExportCommand, FaultsOfTheInputAreNamed) {
  const TemporaryFolder folder;
  const auto error_of = [&](const std::string& arguments) {
    const ProgramResult result = RunHoldfast(folder.Path(), "export " + arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_EQ(Listing(folder.Path()), "") << arguments;
    return result.err;
  };
  EXPECT_THAT(error_of("nowhere.npz -o a.glb"), HasSubstr("nowhere.npz"));
  EXPECT_THAT(error_of("demo_drink -o /dev/null/folder/a.glb"), HasSubstr("/dev/null/folder"));
  EXPECT_THAT(error_of("demo_drink -o /dev/null/a_%d.ply --end 2"), HasSubstr("/dev/null"));
  EXPECT_THAT(error_of("demo_drink -o a.glb --start 9 --end 9"), HasSubstr("--start"));
  EXPECT_THAT(error_of("demo_drink -o a.glb --end 100000"), HasSubstr("99999"));
  EXPECT_THAT(error_of("demo_drink -o a.glb --object mug"), HasSubstr("no object trajectory"));
}

// The object's mesh is gone: said, and the body is still worth having.
TEST(ExportCommand, AnObjectWithoutItsMeshIsToldAndLeftOut) {
  const TemporaryFolder folder;
  MakeHeldClip(folder);
  Clip clip = ReadClip(folder / "held.npz");
  clip.object->name = "";
  clip.object->mesh = "lost.ply";
  WriteClip(clip, folder / "held.npz");
  const ProgramResult result = RunHoldfast(folder.Path(), "export held.npz -o a.glb --json");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("lost.ply"));
  EXPECT_EQ(nlohmann::json::parse(result.out)["object"], false);
  EXPECT_EQ(GlbFile(folder / "a.glb").Json()["meshes"].size(), 1u);
}

}  // namespace
}  // namespace holdfast
