// SPDX-License-Identifier: MIT
#include "geometry/io/mesh/textured_mesh.h"

#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kPng = "\x89PNG\r\n\x1a\n and the rest";

// A flat square in wood whose halves differ in texture along their common edge, and a triangle in
// metal without texture coordinates.
constexpr const char* kObj =
    "mtllib look of it.mtl\n"
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n"
    "vt 0 0\nvt 1 0\nvt 1 0.25\nvt 0 1\nvt 0.5 0.5\n"
    "usemtl wood\n"
    "f 1/1 2/2 3/3\nf 1/5 3/3 4/4\n"
    "usemtl steel\n"
    "f 1 2 5\n";

class TexturedObj : public ::testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  std::optional<TexturedMesh> Read(const std::string& materials, double scale = 1) {
    Write("thing.obj", kObj);
    Write("look of it.mtl", materials);
    return ReadTexturedObj(folder_ / "thing.obj", scale);
  }
  const testing::TemporaryFolder folder_;
};

TEST_F(TexturedObj, KeepsCoordinatesMaterialsAndImages) {
  Write("textures/oak plank.png", kPng);
  const auto mesh = Read(
      "newmtl wood\nKd 0.1 0.2 0.3\nmap_Kd -s 2 2 -clamp on textures\\oak plank.png\n"
      "newmtl steel\nKd 0.5 0.6 0.7\nd 0.25\nPm 1\nNs 250\n",
      0.5);
  ASSERT_TRUE(mesh);
  EXPECT_THAT(mesh->notes, IsEmpty());
  ASSERT_EQ(mesh->parts.size(), 2u);
  const Material& wood = mesh->materials[mesh->parts[0].material];
  EXPECT_EQ(wood.name, "wood");
  EXPECT_EQ(wood.image, kPng);
  EXPECT_EQ(wood.color, Eigen::Vector4d(1, 1, 1, 1));  // the image has the color
  const Material& steel = mesh->materials[mesh->parts[1].material];
  EXPECT_EQ(steel.color, Eigen::Vector4d(0.5, 0.6, 0.7, 0.25));
  EXPECT_EQ(steel.metallic, 1);
  EXPECT_NEAR(steel.roughness, 0.5, 1e-12);

  const TexturedMesh::Part& square = mesh->parts[0];
  EXPECT_EQ(square.mesh.NumVertices(), 5);  // one corner has two places in the image
  ASSERT_EQ(square.mesh.NumFaces(), 2);
  const auto corner = [&](int face, int k) { return square.mesh.faces(k, face); };
  EXPECT_EQ(square.mesh.vertices.col(corner(1, 1)), Eigen::Vector3d(0.5, 0.5, 0));
  EXPECT_EQ(square.uv.col(corner(1, 1)), Eigen::Vector2d(1, 0.25));
  EXPECT_EQ(square.uv.col(corner(0, 0)), Eigen::Vector2d(0, 0));
  EXPECT_EQ(square.uv.col(corner(1, 0)), Eigen::Vector2d(0.5, 0.5));
  EXPECT_LT((square.normals.colwise() - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_EQ(mesh->parts[1].uv.size(), 0);
  EXPECT_EQ(mesh->parts[1].mesh.NumFaces(), 1);
}

TEST_F(TexturedObj, TellsWhatIsNotThere) {
  EXPECT_THAT(Read("newmtl wood\nmap_Kd oak.png\n")->notes,
              ElementsAre(HasSubstr("'oak.png' is not beside the mesh")));
  Write("oak.png", "GIF89a");
  EXPECT_THAT(Read("newmtl wood\nmap_Kd oak.png\n")->notes,
              ElementsAre(HasSubstr("neither PNG nor JPEG")));
  Write("other.obj", "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
  EXPECT_THAT(ReadTexturedObj(folder_ / "other.obj")->notes, ElementsAre(HasSubstr("gone.mtl")));
}

// Nothing but what lies beside the mesh is opened.
TEST_F(TexturedObj, ReadsNothingElsewhere) {
  Write("secret.png", kPng);
  Write("sub/thing.obj", kObj);
  for (const std::string& path :
       {std::string("../secret.png"), (folder_ / "secret.png").string()}) {
    Write("sub/look of it.mtl", "newmtl wood\nmap_Kd " + path + "\n");
    const auto mesh = ReadTexturedObj(folder_ / "sub/thing.obj");
    EXPECT_EQ(mesh->materials[0].image, "") << path;
    EXPECT_EQ(mesh->notes.size(), 1u) << path;
  }
}

// Materials share one large image, and each would take it whole.
TEST_F(TexturedObj, BoundsWhatImagesTakeTogether) {
  Write("large.png", kPng);
  std::filesystem::resize_file(folder_ / "large.png", std::uintmax_t{100} << 20);
  std::string materials, faces;
  for (int k = 0; k < 5; ++k) {
    materials += fmt::format("newmtl m{}\nKd 0 0 0\nmap_Kd large.png\n", k);
    faces += fmt::format("usemtl m{}\nf 1 2 3\n", k);
  }
  Write("shared.mtl", materials);
  Write("shared.obj", "mtllib shared.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n" + faces);
  const auto mesh = ReadTexturedObj(folder_ / "shared.obj");
  ASSERT_TRUE(mesh);
  for (int k = 0; k < 5; ++k) EXPECT_EQ(mesh->materials[k].image.empty(), k > 1) << k;
  EXPECT_EQ(mesh->materials[4].color.head<3>(), Eigen::Vector3d::Zero());
  EXPECT_THAT(mesh->notes, ElementsAre(HasSubstr("the image 'large.png' and those after it")));
}

TEST_F(TexturedObj, HasNothingToTellOfABareMesh) {
  Write("bare.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n");
  EXPECT_FALSE(ReadTexturedObj(folder_ / "bare.obj"));
  Write("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  EXPECT_THROW(ReadTexturedObj(folder_ / "bad.obj"), Error);
}

// Ids may run backwards or past the end; a texture that is not there is none.
TEST_F(TexturedObj, TakesOddIds) {
  Write("odd.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5 0.25\nf -3/-1 -2/9 -1/99999999999\nf 1/0 2/0 3//\n");
  const auto mesh = ReadTexturedObj(folder_ / "odd.obj");
  ASSERT_TRUE(mesh);
  ASSERT_EQ(mesh->parts.size(), 1u);
  EXPECT_EQ(mesh->parts[0].uv.col(mesh->parts[0].mesh.faces(0, 0)), Eigen::Vector2d(0.5, 0.25));
  EXPECT_EQ(mesh->parts[0].uv.col(mesh->parts[0].mesh.faces(1, 0)), Eigen::Vector2d(0, 0));
}

}  // namespace
}  // namespace holdfast
