// SPDX-License-Identifier: MIT
// Each kind of bad input, through the program: the message names what is wrong and what to do, the
// exit code is the documented one, and nothing half-written is left.
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/clip/clip.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/program.h"
#include "tests/support/synthetic_body.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::Listing;
using testing::ProgramResult;
using testing::RunHoldfast;
using testing::SyntheticBody;
using testing::TemporaryFolder;

void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

// The members of a sound clip of `frames` frames; cases below replace some.
NpzWriter ClipMembers(std::size_t frames = 3) {
  NpzWriter writer;
  writer.AddFloat64("mocap_frame_rate", {}, {30.0});
  writer.AddFloat64("trans", {frames, 3}, std::vector<double>(3 * frames, 1.0));
  writer.AddFloat64("root_orient", {frames, 3}, std::vector<double>(3 * frames, 0.1));
  writer.AddFloat64("pose_body", {frames, 63}, std::vector<double>(63 * frames, 0.0));
  writer.AddFloat64("pose_hand", {frames, 90}, std::vector<double>(90 * frames, 0.0));
  return writer;
}

TriangleMesh Tetrahedron(double size) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, size, 0, 0, 0, 0, size, 0, 0, 0, 0, size;
  mesh.faces.resize(3, 4);
  mesh.faces << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
  return mesh;
}

struct Case {
  std::string name;
  std::function<void(const TemporaryFolder&)> prepare;
  std::string arguments;
  int exit_code;
  std::vector<std::string> said;  // each in the message
  std::string prefix = "";
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

class BadInput : public ::testing::TestWithParam<Case> {};

TEST_P(BadInput, IsNamedWithItsRemedyAndLeavesNothing) {
  const Case& c = GetParam();
  const TemporaryFolder folder;
  if (c.prepare) c.prepare(folder);
  const std::string before = Listing(folder.Path());
  const ProgramResult result = RunHoldfast(folder.Path(), c.arguments, c.prefix);
  EXPECT_EQ(result.exit_code, c.exit_code) << result.err;
  for (const std::string& text : c.said) EXPECT_THAT(result.err, HasSubstr(text));
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(Listing(folder.Path()), before) << result.err;
}

std::vector<Case> Cases() {
  const auto clip = [](const std::function<void(NpzWriter&)>& change) {
    return [change](const TemporaryFolder& folder) {
      NpzWriter writer = ClipMembers();
      change(writer);
      writer.Write(folder / "clip.npz");
    };
  };
  const auto file = [](const char* name, const std::string& text) {
    return [name, text](const TemporaryFolder& folder) { WriteText(folder / name, text); };
  };
  const auto truncated = [](const TemporaryFolder& folder) {
    ClipMembers().Write(folder / "whole.npz");
    const std::string bytes = testing::ReadText(folder / "whole.npz");
    WriteText(folder / "clip.npz", bytes.substr(0, bytes.size() / 2));
  };
  const auto model = [](const std::function<void(NpzWriter&)>& change) {
    return [change](const TemporaryFolder& folder) {
      SyntheticBody(60).Write(folder / "model.npz", {}, change);
    };
  };
  const std::string fit = "fit clip.npz cube -o out";
  const std::string mesh_fit = "fit demo_drink mesh.obj -o out";
  std::vector<Case> cases = {
      // clips
      {"MissingClip",
       {},
       fit,
       1,
       {"clip.npz: is neither a file nor an embedded clip", "demo_drink"}},
      {"EmptyClip", file("clip.npz", ""), fit, 1, {"clip.npz: is empty"}},
      {"GarbageClip",
       file("clip.npz", std::string(3000, 'x')),
       fit,
       1,
       {"clip.npz", "is not of a supported format"}},
      {"TruncatedClip", truncated, fit, 1, {"clip.npz", "cut off"}},
      {"FolderAsClip",
       [](const TemporaryFolder& f) { std::filesystem::create_directory(f / "clip.npz"); },
       fit,
       1,
       {"clip.npz: is a folder"}},
      {"ClipWithoutTranslation",
       [](const TemporaryFolder& f) {
         NpzWriter writer;
         writer.AddFloat64("mocap_frame_rate", {}, {30.0});
         writer.Write(f / "clip.npz");
       },
       fit,
       1,
       {"clip.npz[trans]: is missing", "mocap_frame_rate"}},
      {"WrongShapeClip",
       clip([](NpzWriter& w) {
         w.AddFloat64("pose_body", {3, 66}, std::vector<double>(198));
       }),
       fit,
       1,
       {"clip.npz[pose_body]: has shape (3, 66)", "(N, 63)"}},
      {"UnequalLengths",
       clip([](NpzWriter& w) {
         w.AddFloat64("pose_body", {4, 63}, std::vector<double>(4 * 63));
       }),
       fit,
       1,
       {"[pose_body]: has 4 frames where trans has 3"}},
      {"NanClip",
       clip([](NpzWriter& w) {
         std::vector<double> values(9, 0.0);
         values[5] = NAN;
         w.AddFloat64("trans", {3, 3}, values);
       }),
       fit,
       1,
       {"clip.npz[trans]: holds nan in frame 1"}},
      {"TextForNumbers",
       clip([](NpzWriter& w) { w.AddText("trans", "hello"); }),
       fit,
       1,
       {"clip.npz[trans]", "shape ()"}},
      {"ObjectArray",
       clip([](NpzWriter& w) {
         w.Add("trans", NpyArray{'O', 8, false, false, {3, 3}, std::vector<std::byte>(72)});
       }),
       fit,
       1,
       {"clip.npz[trans]: holds Python objects"}},
      {"NoFrames",
       [](const TemporaryFolder& f) { ClipMembers(0).Write(f / "clip.npz"); },
       fit,
       1,
       {"clip.npz: has no frames"}},
      {"ZeroFrameRate",
       clip([](NpzWriter& w) { w.AddFloat64("mocap_frame_rate", {}, {0.0}); }),
       fit,
       1,
       {"[mocap_frame_rate]: is not one positive number"}},
      {"WrongHoldingHand",
       clip([](NpzWriter& w) {
         w.AddUint8("holding_hand", {3}, {1, 9, 0});
       }),
       fit,
       1,
       {"[holding_hand]: holds 9"}},
      {"NothingBetweenStartAndEnd",
       clip([](NpzWriter&) {}),
       fit + " --start 7",
       1,
       {"has 3 frames: no frames between 7 and 3"}},
      // meshes
      {"MissingMesh",
       {},
       mesh_fit,
       1,
       {"mesh.obj: is neither a file nor an embedded object", "mug"}},
      {"EmptyMesh", file("mesh.obj", ""), mesh_fit, 1, {"mesh.obj: is empty"}},
      {"GarbageMesh",
       file("mesh.obj", std::string("\x00\xff\x13 not a mesh", 14)),
       mesh_fit,
       1,
       {"mesh.obj"}},
      {"TruncatedMesh",
       [](const TemporaryFolder& f) {
         WriteMesh(Tetrahedron(0.05), f / "whole.ply");
         const std::string bytes = testing::ReadText(f / "whole.ply");
         WriteText(f / "mesh.ply", bytes.substr(0, bytes.size() - 20));
       },
       "fit demo_drink mesh.ply -o out",
       1,
       {"mesh.ply"}},
      {"NanMesh",
       file("mesh.obj", "v 0 0 0\nv 0.1 0 0\nv nan 0.1 0\nf 1 2 3\n"),
       mesh_fit,
       1,
       {"mesh.obj"}},
      {"FaceOutOfRange",
       file("mesh.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 9\n"),
       mesh_fit,
       1,
       {"mesh.obj"}},
      {"NoVertices", file("mesh.obj", "# nothing here\n"), mesh_fit, 1, {"mesh.obj"}},
      {"PointsOnly",
       file("mesh.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\n"),
       mesh_fit,
       1,
       {"mesh.obj"}},
      {"ZeroAreaMesh",
       file("mesh.obj", "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n"),
       mesh_fit,
       1,
       {""}},
      {"WrongMeshType",
       file("mesh.fbx", "Kaydara"),
       "fit demo_drink mesh.fbx -o out",
       1,
       {"mesh.fbx", "Use .obj, .ply, .stl, .off, .glb or .gltf"}},
      {"HugePlyHeader",
       file("mesh.ply",
            "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty "
            "float x\nproperty float y\nproperty float z\nelement face 1\nproperty "
            "list uchar int vertex_indices\nend_header\n0 0 0\n"),
       "fit demo_drink mesh.ply -o out",
       1,
       {"mesh.ply"}},
      {"ThousandTimesTooLarge",
       [](const TemporaryFolder& f) { WriteMesh(Tetrahedron(80.0), f / "mesh.obj"); },
       mesh_fit + " -q",
       1,
       {"not a graspable size", "--object-scale 0.001"}},
      {"ThousandTimesTooSmall",
       [](const TemporaryFolder& f) { WriteMesh(Tetrahedron(8e-5), f / "mesh.obj"); },
       mesh_fit + " -q",
       1,
       {"not a graspable size", "--object-scale 1000"}},
      {"AHandSizedThingInCentimeters",
       [](const TemporaryFolder& f) { WriteMesh(Tetrahedron(12.0), f / "mesh.obj"); },
       mesh_fit + " -q",
       1,
       {"not a graspable size", "centimeters", "--object-scale 0.01 makes it 12 x 12 x 12 cm"}},
      // The searches take a minute to say so.
      {"NothingWithinAHandsSpan",
       [](const TemporaryFolder& f) {
         WriteMesh(testing::Box({0, 0, 0}, {1.5, 1.5, 1.5}), f / "mesh.obj");
       },
       "grasp mesh.obj -o out.npz -q",
       3,
       {"mesh: no part of it is thinner than", "150.0 x 150.0 x 150.0 cm"},
       "timeout 20"},
      {"NothingToFitWithinAHandsSpan",
       [](const TemporaryFolder& f) {
         WriteMesh(testing::Box({0, 0, 0}, {1.5, 1.5, 1.5}), f / "mesh.obj");
       },
       mesh_fit + " -q",
       3,
       {"mesh: no part of it is thinner than"},
       "timeout 20"},
      // body models
      {"MissingModel", {}, "body info model.npz", 1, {"model.npz: does not exist"}},
      {"EmptyModel", file("model.npz", ""), "body info model.npz", 1, {"model.npz: is empty"}},
      {"ClipAsModel",
       [](const TemporaryFolder& f) { ClipMembers().Write(f / "model.npz"); },
       "body info model.npz",
       1,
       {"[kintree_table]: is missing", "pose_body"}},
      {"NanModel",
       model([](NpzWriter& w) {
         w.AddFloat64("v_template", {60, 3}, std::vector<double>(180, NAN));
       }),
       "body info model.npz",
       1,
       {"model.npz[v_template]: holds nan"}},
      {"WrongShapeModel",
       model([](NpzWriter& w) {
         w.AddFloat64("weights", {60, 24}, std::vector<double>(60 * 24));
       }),
       "body info model.npz",
       1,
       {"[weights]: has shape (60, 24)", "(60, 55)"}},
      {"WrongTypeModel",
       model([](NpzWriter& w) {
         w.AddFloat64("f", {1, 3}, {0.0, 1.5, 2.0});
       }),
       "body info model.npz",
       1,
       {"model.npz[f]: holds 1.5 where a whole number is needed"}},
      {"TruncatedModel",
       [](const TemporaryFolder& f) {
         SyntheticBody(60).Write(f / "whole.npz");
         const std::string bytes = testing::ReadText(f / "whole.npz");
         WriteText(f / "model.npz", bytes.substr(0, bytes.size() - 100));
       },
       "body info model.npz",
       1,
       {"model.npz"}},
      // motions to import
      {"MissingMotion", {}, "import walk.bvh -o walk.npz", 1, {"walk.bvh"}},
      {"EmptyMotion", file("walk.bvh", ""), "import walk.bvh -o walk.npz", 1, {"walk.bvh"}},
      {"TruncatedMotion",
       file("walk.bvh", "HIERARCHY\nROOT Hips\n{\n  OFFSET 0 0"),
       "import walk.bvh -o walk.npz",
       1,
       {"walk.bvh"}},
      {"UnknownSkeleton",
       file("walk.bvh",
            "HIERARCHY\nROOT quux\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition "
            "Zrotation "
            "Xrotation Yrotation\n JOINT frob\n {\n OFFSET 0 10 0\n CHANNELS 3 Zrotation Xrotation "
            "Yrotation\n End Site\n {\n OFFSET 0 5 0\n }\n }\n}\nMOTION\nFrames: 1\nFrame Time: "
            "0.033\n0 "
            "0 0 0 0 0 0 0 0\n"),
       "import walk.bvh -o walk.npz",
       1,
       {"quux", "--map"}},
      // places to write to
      {"OutputExists",
       [](const TemporaryFolder& f) {
         std::filesystem::create_directory(f / "out");
         WriteText(f / "out" / "mine.txt", "precious");
       },
       "fit demo_drink cube -o out",
       1,
       {"out: exists already", "--force"}},
      {"OutputIsNotAResult",
       [](const TemporaryFolder& f) {
         std::filesystem::create_directory(f / "out");
         WriteText(f / "out" / "mine.txt", "precious");
       },
       "fit demo_drink cube -o out --force",
       1,
       {"out: is not a result folder"}},
      {"NoFolderThere",
       file("no", "a file"),
       "decimate cube -o no/where/cube.ply",
       1,
       {"no/where/cube.ply: cannot be written", "is not a folder"}},
      {"FullDiskMesh",
       {},
       "decimate cube -o cube.obj",
       1,
       {"cube.obj", "could not be written"},
       "trap '' XFSZ; ulimit -f 2;"},
      {"FullDiskResult",
       [](const TemporaryFolder& f) { ClipMembers().Write(f / "clip.npz"); },
       fit + " -q",
       1,
       {"could not be written"},
       "trap '' XFSZ; ulimit -f 8;"},
      // command lines
      {"UnknownCommand", {}, "levitate", 2, {"levitate"}},
      {"EmptyOutput", {}, "fit demo_drink cube -o ''", 1, {"--output: is empty"}},
      {"EmptyOutputOfAFile", {}, "decimate cube -o ''", 1, {"--output: is empty"}},
      {"ObjectBeforeClip", {}, "fit mug demo_drink -o out", 1, {"mug: is an embedded object"}},
      {"UnknownOption", {}, "fit demo_drink cube -o out --warp 9", 2, {"--warp"}},
      {"WrongHand", {}, "fit demo_drink cube -o out --hand third", 2, {"--hand"}},
  };
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Every, BadInput, ::testing::ValuesIn(Cases()),
                         [](const auto& c) { return c.param.name; });

// A fan of `count` vertices or more on a ball of radius 5 cm, closed.
TriangleMesh Ball(int rings, int sectors) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 2 + rings * sectors);
  mesh.vertices.col(0) = Eigen::Vector3d(0, 0, -0.05);
  mesh.vertices.col(1) = Eigen::Vector3d(0, 0, 0.05);
  for (int r = 0; r < rings; ++r) {
    const double v = std::numbers::pi * (r + 1.0) / (rings + 1.0);
    for (int s = 0; s < sectors; ++s) {
      const double u = 2.0 * std::numbers::pi * s / sectors;
      mesh.vertices.col(2 + r * sectors + s) =
          0.05 *
          Eigen::Vector3d(std::sin(v) * std::cos(u), std::sin(v) * std::sin(u), -std::cos(v));
    }
  }
  mesh.faces.resize(3, 2 * rings * sectors);
  Eigen::Index f = 0;
  const auto id = [&](int r, int s) { return 2 + r * sectors + s % sectors; };
  for (int s = 0; s < sectors; ++s) {
    mesh.faces.col(f++) = Eigen::Vector3i(0, id(0, s + 1), id(0, s));
    mesh.faces.col(f++) = Eigen::Vector3i(1, id(rings - 1, s), id(rings - 1, s + 1));
    for (int r = 0; r + 1 < rings; ++r) {
      mesh.faces.col(f++) = Eigen::Vector3i(id(r, s), id(r, s + 1), id(r + 1, s));
      mesh.faces.col(f++) = Eigen::Vector3i(id(r, s + 1), id(r + 1, s + 1), id(r + 1, s));
    }
  }
  return mesh;
}

TEST(LargeInput, TwoMillionVerticesAreDecimated) {
  const TemporaryFolder folder;
  WriteMesh(Ball(1000, 2000), folder / "huge.ply");
  const ProgramResult result =
      RunHoldfast(folder.Path(), "decimate huge.ply -o small.ply --json -q");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(ReadMesh(folder / "small.ply").NumVertices(), 300);
}

TEST(UncleanInput, ANonManifoldMeshIsHeldAndSaidToBeSo) {
  // Two tetrahedra that share an edge, and a third face on it.
  const TemporaryFolder folder;
  WriteText(folder / "mesh.obj",
            "v 0 0 0\nv 0.06 0 0\nv 0 0.06 0\nv 0 0 0.06\nv 0 -0.06 0\nv 0 0 -0.06\n"
            "f 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\nf 1 2 5\nf 1 5 6\nf 1 6 2\nf 2 6 5\n");
  const ProgramResult result = RunHoldfast(folder.Path(), "fit demo_drink mesh.obj -o out --end 3");
  EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 3) << result.err;
  EXPECT_NE(result.err, "");
}

TEST(SmallInput, AClipOfOneFrameIsFitted) {
  const TemporaryFolder folder;
  const ProgramResult result =
      RunHoldfast(folder.Path(), "fit demo_drink cylinder -o out --end 1 --json");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(ReadClip(folder / "out/clip.npz").NumFrames(), 1);
}

}  // namespace
}  // namespace holdfast
