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

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::Listing;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::SyntheticBody;

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
  std::function<void(const ProgramFolder&)> prepare;
  std::vector<std::string> said;  // each in the message
  std::string arguments = "";     // "" is what its section has
  int exit_code = 1;
  std::string prefix = "";
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

class BadInput : public ::testing::TestWithParam<Case> {};

TEST_P(BadInput, IsNamedWithItsRemedyAndLeavesNothing) {
  const Case& c = GetParam();
  const ProgramFolder folder;
  if (c.prepare) c.prepare(folder);
  const std::string before = Listing(folder.Path());
  const ProgramResult result = folder.Run(c.arguments, c.exit_code, c.prefix);
  for (const std::string& text : c.said) EXPECT_THAT(result.err, HasSubstr(text));
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(Listing(folder.Path()), before) << result.err;
}

std::vector<Case> Cases() {
  using Folder = ProgramFolder;
  const auto file = [](const char* name, const std::string& text) {
    return [name, text](const Folder& f) { WriteText(f / name, text); };
  };
  const auto cut = [](const Folder& f, const char* whole, const char* name, std::size_t bytes) {
    const std::string text = testing::ReadText(f / whole);
    WriteText(f / name, text.substr(0, text.size() - bytes));
  };
  const auto clip = [](const std::function<void(NpzWriter&)>& change) {
    return [change](const Folder& f) {
      NpzWriter writer = ClipMembers();
      change(writer);
      writer.Write(f / "clip.npz");
    };
  };
  const auto zeros = [clip](const char* key, const std::vector<std::size_t>& shape) {
    std::size_t count = 1;
    for (const std::size_t size : shape) count *= size;
    return clip([=](NpzWriter& w) { w.AddFloat64(key, shape, std::vector<double>(count)); });
  };
  const auto model = [](const char* key, const std::vector<std::size_t>& shape,
                        const std::vector<double>& values) {
    return [=](const Folder& f) {
      SyntheticBody(60).Write(f / "model.npz", {},
                              [&](NpzWriter& w) { w.AddFloat64(key, shape, values); });
    };
  };
  const auto mesh = [](const TriangleMesh& shape) {
    return [shape](const Folder& f) { WriteMesh(shape, f / "mesh.obj"); };
  };
  const auto box = mesh(testing::Box({0, 0, 0}, {1.5, 1.5, 1.5}));
  const auto not_a_result = [](const Folder& f) {
    std::filesystem::create_directory(f / "out");
    WriteText(f / "out" / "mine.txt", "precious");
  };
  const std::string fit = "fit clip.npz cube -o out";
  const std::string mesh_fit = "fit demo_drink mesh.obj -o out";
  const std::string ply_fit = "fit demo_drink mesh.ply -o out";
  const std::string demo_fit = "fit demo_drink cube -o out";
  const std::string full_disk = "trap '' XFSZ; ulimit -f ";

  std::vector<Case> cases;
  const auto add = [&](const std::string& arguments, const std::vector<Case>& section) {
    for (const Case& c : section) {
      cases.push_back(c);
      if (c.arguments.empty()) cases.back().arguments = arguments;
    }
  };
  add(fit, {{"MissingClip", {}, {"clip.npz: is neither a file nor an embedded clip", "demo_drink"}},
            {"EmptyClip", file("clip.npz", ""), {"clip.npz: is empty"}},
            {"GarbageClip",
             file("clip.npz", std::string(3000, 'x')),
             {"clip.npz", "is not of a supported format"}},
            {"TruncatedClip",
             [=](const Folder& f) {
               ClipMembers().Write(f / "whole.npz");
               cut(f, "whole.npz", "clip.npz", std::filesystem::file_size(f / "whole.npz") / 2);
             },
             {"clip.npz", "cut off"}},
            {"FolderAsClip",
             [](const Folder& f) { std::filesystem::create_directory(f / "clip.npz"); },
             {"clip.npz: is a folder"}},
            {"ClipWithoutTranslation",
             [](const Folder& f) {
               NpzWriter writer;
               writer.AddFloat64("mocap_frame_rate", {}, {30.0});
               writer.Write(f / "clip.npz");
             },
             {"clip.npz[trans]: is missing", "mocap_frame_rate"}},
            {"WrongShapeClip",
             zeros("pose_body", {3, 66}),
             {"clip.npz[pose_body]: has shape (3, 66)", "(N, 63)"}},
            {"UnequalLengths",
             zeros("pose_body", {4, 63}),
             {"[pose_body]: has 4 frames where trans has 3"}},
            {"NanClip",
             clip([](NpzWriter& w) {
               w.AddFloat64("trans", {3, 3}, {0, 0, 0, 0, 0, NAN, 0, 0, 0});
             }),
             {"clip.npz[trans]: holds nan in frame 1"}},
            {"TextForNumbers",
             clip([](NpzWriter& w) { w.AddText("trans", "hello"); }),
             {"clip.npz[trans]", "shape ()"}},
            {"ObjectArray",
             clip([](NpzWriter& w) {
               w.Add("trans", NpyArray{'O', 8, false, false, {3, 3}, std::vector<std::byte>(72)});
             }),
             {"clip.npz[trans]: holds Python objects"}},
            {"NoFrames",
             [](const Folder& f) { ClipMembers(0).Write(f / "clip.npz"); },
             {"clip.npz: has no frames"}},
            {"ZeroFrameRate",
             zeros("mocap_frame_rate", {}),
             {"[mocap_frame_rate]: is not one positive number"}},
            {"WrongHoldingHand",
             clip([](NpzWriter& w) {
               w.AddUint8("holding_hand", {3}, {1, 9, 0});
             }),
             {"[holding_hand]: holds 9"}},
            {"NothingBetweenStartAndEnd",
             clip([](NpzWriter&) {}),
             {"has 3 frames: no frames between 7 and 3"},
             fit + " --start 7"}});
  add(mesh_fit,
      {{"MissingMesh", {}, {"mesh.obj: is neither a file nor an embedded object", "mug"}},
       {"EmptyMesh", file("mesh.obj", ""), {"mesh.obj: is empty"}},
       {"GarbageMesh", file("mesh.obj", std::string("\x00\xff\x13 not a mesh", 14)), {"mesh.obj"}},
       {"TruncatedMesh",
        [=](const Folder& f) {
          WriteMesh(Tetrahedron(0.05), f / "whole.ply");
          cut(f, "whole.ply", "mesh.ply", 20);
        },
        {"mesh.ply"},
        ply_fit},
       {"NanMesh", file("mesh.obj", "v 0 0 0\nv 0.1 0 0\nv nan 0.1 0\nf 1 2 3\n"), {"mesh.obj"}},
       {"FaceOutOfRange",
        file("mesh.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 9\n"),
        {"mesh.obj"}},
       {"NoVertices", file("mesh.obj", "# nothing here\n"), {"mesh.obj"}},
       {"PointsOnly", file("mesh.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\n"), {"mesh.obj"}},
       {"ZeroAreaMesh", file("mesh.obj", "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n"), {}},
       {"WrongMeshType",
        file("mesh.fbx", "Kaydara"),
        {"mesh.fbx", "Use .obj, .ply, .stl, .off, .glb or .gltf"},
        "fit demo_drink mesh.fbx -o out"},
       {"HugePlyHeader",
        file("mesh.ply",
             "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty "
             "float x\nproperty float y\nproperty float z\nelement face 1\nproperty "
             "list uchar int vertex_indices\nend_header\n0 0 0\n"),
        {"mesh.ply"},
        ply_fit}});
  add(mesh_fit + " -q",
      {{"ThousandTimesTooLarge",
        mesh(Tetrahedron(80.0)),
        {"not a graspable size", "--object-scale 0.001"}},
       {"ThousandTimesTooSmall",
        mesh(Tetrahedron(8e-5)),
        {"not a graspable size", "--object-scale 1000"}},
       {"AHandSizedThingInCentimeters",
        mesh(Tetrahedron(12.0)),
        {"not a graspable size", "centimeters", "--object-scale 0.01 makes it 12 x 12 x 12 cm"}},
       // The searches take a minute to say so.
       {"NothingWithinAHandsSpan",
        box,
        {"mesh: no part of it is thinner than", "150.0 x 150.0 x 150.0 cm"},
        "grasp mesh.obj -o out.npz -q",
        3,
        "timeout 20"},
       {"NothingToFitWithinAHandsSpan",
        box,
        {"mesh: no part of it is thinner than"},
        "",
        3,
        "timeout 20"}});
  add("body info model.npz", {{"MissingModel", {}, {"model.npz: does not exist"}},
                              {"EmptyModel", file("model.npz", ""), {"model.npz: is empty"}},
                              {"ClipAsModel",
                               [](const Folder& f) { ClipMembers().Write(f / "model.npz"); },
                               {"[kintree_table]: is missing", "pose_body"}},
                              {"NanModel",
                               model("v_template", {60, 3}, std::vector<double>(180, NAN)),
                               {"model.npz[v_template]: holds nan"}},
                              {"WrongShapeModel",
                               model("weights", {60, 24}, std::vector<double>(60 * 24)),
                               {"[weights]: has shape (60, 24)", "(60, 55)"}},
                              {"WrongTypeModel",
                               model("f", {1, 3}, {0.0, 1.5, 2.0}),
                               {"model.npz[f]: holds 1.5 where a whole number is needed"}},
                              {"TruncatedModel",
                               [=](const Folder& f) {
                                 SyntheticBody(60).Write(f / "whole.npz");
                                 cut(f, "whole.npz", "model.npz", 100);
                               },
                               {"model.npz"}}});
  add("import walk.bvh -o walk.npz",
      {{"MissingMotion", {}, {"walk.bvh"}},
       {"EmptyMotion", file("walk.bvh", ""), {"walk.bvh"}},
       {"TruncatedMotion", file("walk.bvh", "HIERARCHY\nROOT Hips\n{\n  OFFSET 0 0"), {"walk.bvh"}},
       {"UnknownSkeleton",
        file("walk.bvh",
             "HIERARCHY\nROOT quux\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition "
             "Zrotation Xrotation Yrotation\n JOINT frob\n {\n OFFSET 0 10 0\n CHANNELS 3 "
             "Zrotation Xrotation Yrotation\n End Site\n {\n OFFSET 0 5 0\n }\n }\n}\nMOTION\n"
             "Frames: 1\nFrame Time: 0.033\n0 0 0 0 0 0 0 0 0\n"),
        {"quux", "--map"}}});
  // Places to write to.
  add(demo_fit,
      {{"OutputExists", not_a_result, {"out: exists already", "--force"}},
       {"OutputIsNotAResult", not_a_result, {"out: is not a result folder"}, demo_fit + " --force"},
       {"NoFolderThere",
        file("no", "a file"),
        {"no/where/cube.ply: cannot be written", "is not a folder"},
        "decimate cube -o no/where/cube.ply"},
       {"FullDiskMesh",
        {},
        {"cube.obj", "could not be written"},
        "decimate cube -o cube.obj",
        1,
        full_disk + "2;"},
       {"FullDiskResult",
        [](const Folder& f) { ClipMembers().Write(f / "clip.npz"); },
        {"could not be written"},
        fit + " -q",
        1,
        full_disk + "8;"}});
  // Command lines.
  add("", {{"UnknownCommand", {}, {"levitate"}, "levitate", 2},
           {"EmptyOutput", {}, {"--output: is empty"}, "fit demo_drink cube -o ''"},
           {"EmptyOutputOfAFile", {}, {"--output: is empty"}, "decimate cube -o ''"},
           {"ObjectBeforeClip", {}, {"mug: is an embedded object"}, "fit mug demo_drink -o out"},
           {"UnknownOption", {}, {"--warp"}, demo_fit + " --warp 9", 2},
           {"WrongHand", {}, {"--hand"}, demo_fit + " --hand third", 2}});
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
  const ProgramFolder folder;
  WriteMesh(Ball(1000, 2000), folder / "huge.ply");
  folder.Run("decimate huge.ply -o small.ply --json -q");
  EXPECT_EQ(ReadMesh(folder / "small.ply").NumVertices(), 300);
}

TEST(UncleanInput, ANonManifoldMeshIsHeldAndSaidToBeSo) {
  // Two tetrahedra that share an edge, and a third face on it.
  const ProgramFolder folder;
  WriteText(folder / "mesh.obj",
            "v 0 0 0\nv 0.06 0 0\nv 0 0.06 0\nv 0 0 0.06\nv 0 -0.06 0\nv 0 0 -0.06\n"
            "f 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\nf 1 2 5\nf 1 5 6\nf 1 6 2\nf 2 6 5\n");
  const ProgramResult result =
      testing::RunHoldfast(folder.Path(), "fit demo_drink mesh.obj -o out --end 3");
  EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 3) << result.err;
  EXPECT_NE(result.err, "");
}

TEST(SmallInput, AClipOfOneFrameIsFitted) {
  const ProgramFolder folder;
  folder.Run("fit demo_drink cylinder -o out --end 1 --json");
  EXPECT_EQ(ReadClip(folder / "out/clip.npz").NumFrames(), 1);
}

}  // namespace
}  // namespace holdfast
