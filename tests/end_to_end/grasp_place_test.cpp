// SPDX-License-Identifier: MIT
// --at, --region and --avoid through the program: a sword is held by its hilt.
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/clip/clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/mesh/textured_mesh.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/program.h"

namespace holdfast {
namespace {

using nlohmann::json;
using testing::Box;
using testing::ProgramFolder;

// Groups "hilt", "guard" and "blade", the last of material "steel"; in millimeters.
void WriteSword(const std::filesystem::path& path) {
  std::ofstream out(path);
  int before = 1;
  const auto add = [&](const char* head, const TriangleMesh& part) {
    out << head << "\n";
    for (const auto& v : part.vertices.colwise()) {
      out << fmt::format("v {:g} {:g} {:g}\n", v.x(), v.y(), v.z());
    }
    for (const auto& f : part.faces.colwise()) {
      out << fmt::format("f {}// {}// {}//\n", f[0] + before, f[1] + before, f[2] + before);
    }
    before += static_cast<int>(part.NumVertices());
  };
  add("g hilt grip", Box({-14, -11, -200}, {14, 11, 0}));
  add("g guard", Box({-80, -14, 0}, {80, 14, 20}));
  add("g blade\nusemtl steel", Box({-24, -3, 20}, {24, 3, 750}));
}

TEST(MeshGroups, AreGroupsAndMaterialsWithTheirFaces) {
  const ProgramFolder folder;
  WriteSword(folder / "sword.obj");
  const std::vector<MeshGroup> groups = ReadMeshGroups(folder / "sword.obj");
  std::vector<std::string> names;
  for (const MeshGroup& group : groups) names.push_back(group.name);
  EXPECT_THAT(names, ::testing::ElementsAre("hilt", "grip", "guard", "blade", "steel"));
  EXPECT_EQ(groups[1].surface.NumFaces(), 12);
  EXPECT_EQ(groups[4].surface.vertices.row(2).maxCoeff(), 750.0);
}

TEST(GraspPlace, ASwordIsHeldByItsHilt) {
  const ProgramFolder folder;
  WriteSword(folder / "sword.obj");
  std::ofstream(folder / "hilt.txt") << "# the hilt\n0 1 2 3\n4, 5, 6, 7\n";
  const std::string scaled = " --object-scale 0.001 -q";
  for (const char* place : {"--region hilt", "--region hilt.txt", "--avoid steel --avoid guard"}) {
    const json grasp =
        folder.Json(fmt::format("grasp sword.obj -o grasp.npz -f {} {}", place, scaled));
    EXPECT_LE(grasp["place"]["contacts_outside_ratio"].get<double>(), 0.1) << place;
  }
  // A fit begins with such a grasp, of a clip that has another one too.
  const json made = folder.Json("fit demo_drink sword.obj --region hilt --end 2 -o held" + scaled);
  EXPECT_EQ(made["grasp"]["made"], true);
  EXPECT_EQ(made["options"]["place"]["region"][0], "hilt");
  EXPECT_LE(made["grasp"]["contacts_outside_place_ratio"].get<double>(), 0.1);
}

// A carton of 30 x 20 x 12 cm; groups "ends" (of its length) and "around".
void WriteCarton(const std::filesystem::path& path) {
  constexpr int kAcross = 8;
  std::ofstream out(path);
  int vertices = 0;
  const auto face = [&](const char* group, const auto& at) {
    std::string faces = fmt::format("g {}\n", group);
    for (int i = 0; i <= kAcross; ++i) {
      for (int j = 0; j <= kAcross; ++j) {
        const Eigen::Vector3d v = at(2.0 * i / kAcross - 1, 2.0 * j / kAcross - 1);
        out << fmt::format("v {:g} {:g} {:g}\n", 0.15 * v.x(), 0.10 * v.y(), 0.06 * v.z());
        const int a = vertices + i * (kAcross + 1) + j + 1, b = a + kAcross + 1;
        if (i == kAcross || j == kAcross) continue;
        faces += fmt::format("f {} {} {}\nf {} {} {}\n", a, b, b + 1, a, b + 1, a + 1);
      }
    }
    vertices += (kAcross + 1) * (kAcross + 1);
    out << faces;
  };
  using Eigen::Vector3d;
  face("ends", [](double u, double v) { return Vector3d(1, u, v); });
  face("ends", [](double u, double v) { return Vector3d(-1, v, u); });
  face("around", [](double u, double v) { return Vector3d(v, 1, u); });
  face("around", [](double u, double v) { return Vector3d(u, -1, v); });
  face("around", [](double u, double v) { return Vector3d(u, v, 1); });
  face("around", [](double u, double v) { return Vector3d(v, u, -1); });
}

TEST(GraspPlace, IsForBothHandsToo) {
  const ProgramFolder folder;
  WriteCarton(folder / "carton.obj");
  const auto width = [&](const std::string& place) {
    const json made = folder.Json("grasp carton.obj --hand both -o grasp.npz -f -q " + place);
    EXPECT_LE(made["place"]["contacts_outside_ratio"].get<double>(), 0.1) << place;
    return made["width_mm"].get<double>();
  };
  EXPECT_NEAR(width("--region ends"), 300, 1);
  EXPECT_NEAR(width("--avoid ends"), 200, 1);
  EXPECT_NEAR(width("--at 0.15,0.05,0"), 300, 1);
  EXPECT_NEAR(width("--at 0.12,0.1,0"), 200, 1);
}

TEST(GraspPlace, IsForTheReceivingHandToo) {
  const ProgramFolder folder;
  WriteSword(folder / "sword.obj");
  for (const char* place : {"--avoid steel --avoid guard", "--region blade"}) {
    const json made =
        folder.Json(fmt::format("offhand demo_pass sword.obj --object-scale 0.0006 -o passed "
                                "-f --no-report -q {}",
                                place));
    ASSERT_EQ(made["switches"].size(), 1u);
    for (const json& grasp : {made["grasp"], made["switches"][0]["grasp"]}) {
      EXPECT_LE(grasp["contacts_outside_place_ratio"].get<double>(), 0.1) << place;
    }
  }
}

TEST(GraspPlace, SaysWhatThereIs) {
  const ProgramFolder folder;
  WriteSword(folder / "sword.obj");
  std::ofstream(folder / "far.txt") << "0 1 2 99\n";
  struct Case {
    std::string arguments;
    int exit_code;
    const char* said;
  };
  const std::string grasp = "grasp sword.obj --object-scale 0.001 -q -o out.npz ";
  for (const Case& c : std::vector<Case>{
           {grasp + "--region hilts", 1,
            "Did you mean 'hilt'? Choose one of: hilt, grip, guard, blade, steel"},
           {grasp + "--avoid far.txt", 1, "--avoid far.txt:1: '99' is not a vertex of the mesh"},
           {grasp + "--at 0,0,2", 1, "--at: (0, 0, 2) is 125.0 cm from the object's surface"},
           {grasp + "--region hilt --avoid grip", 1, "--avoid: leaves no surface of the object"},
           {grasp + "--at 0,0,2 --hand both", 1, "is 125.0 cm from the object's surface"},
           {grasp + "--at 0,0", 2, "--at"},
           {"grasp mug -q -o out.npz --region handle", 1, "mug has no named parts"},
           {"fit demo_drink sword.obj --object-scale 0.001 -q -o out --end 2 --region hilts", 1,
            "Did you mean 'hilt'?"}}) {
    folder.Fails(c.arguments, c.exit_code, c.said);
  }
}

}  // namespace
}  // namespace holdfast
