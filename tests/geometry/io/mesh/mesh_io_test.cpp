// SPDX-License-Identifier: MIT
#include "geometry/io/mesh/mesh_io.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/mesh/mesh_check.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::Box;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Sphere;
using testing::Torus;
using testing::WithFace;
using testing::WithVertex;

class MeshIo : public ::testing::Test {
 protected:
  fs::path Write(const std::string& name, std::string_view content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return folder_ / name;
  }

  /// The message of the Error that reading throws; fails when it throws nothing or anything else.
  std::string Refusal(const std::string& name, std::string_view content) const {
    return RefusalOf(Write(name, content));
  }
  static std::string RefusalOf(const fs::path& path) {
    try {
      ReadMesh(path);
      ADD_FAILURE() << path << " was read";
    } catch (const Error& error) {
      EXPECT_THAT(error.Where(), HasSubstr(path.filename().string()));
      EXPECT_FALSE(error.Remedy().empty());
      return error.what();
    }
    return {};
  }

  testing::TemporaryFolder folder_;
};

constexpr const char* kPlyHeader =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kPlyTriangle = std::string(kPlyHeader) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

template <typename T>
void Append(std::string& bytes, T value, bool big_endian = false) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (big_endian) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

TEST_F(MeshIo, RoundTripsInEveryFormat) {
  TriangleMesh mesh = Torus(0.05, 0.02, 17, 11);
  mesh.vertices = mesh.vertices.cast<float>().cast<double>().eval();
  for (const char* extension : {".obj", ".ply", ".stl", ".off", ".PLY"}) {
    SCOPED_TRACE(extension);
    const fs::path path = folder_ / (std::string("torus") + extension);
    WriteMesh(mesh, path);
    const MeshFile file = ReadMeshFile(path);
    EXPECT_THAT(file.notes, IsEmpty());
    EXPECT_TRUE(CheckMesh(file.mesh).watertight);
    ASSERT_EQ(file.mesh.NumVertices(), mesh.NumVertices());
    ASSERT_EQ(file.mesh.NumFaces(), mesh.NumFaces());
    // .stl numbers its vertices anew: compare corner by corner.
    for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
      for (int k = 0; k < 3; ++k) {
        EXPECT_LT(
            (file.mesh.vertices.col(file.mesh.faces(k, f)) - mesh.vertices.col(mesh.faces(k, f)))
                .norm(),
            2e-12);
      }
    }
    const std::string once = ReadFile(path);
    WriteMesh(mesh, path);
    EXPECT_EQ(ReadFile(path), once);
  }
  // No temporary is left.
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.Path()), {}), 5);
}

TEST_F(MeshIo, KeepsWhatIsWrongWithAMesh) {
  TriangleMesh mesh = WithVertex(Box({0, 0, 0}, {1, 1, 1}), {2, 2, 2});
  mesh = WithVertex(mesh, mesh.vertices.col(0));
  mesh = WithFace(mesh, 0, 1, 8);                                               // a fin
  mesh = WithFace(mesh, mesh.faces(0, 3), mesh.faces(1, 3), mesh.faces(2, 3));  // doubled
  mesh = WithFace(mesh, 0, 9, 7);                                               // flat
  for (const char* extension : {".obj", ".ply", ".off"}) {
    const fs::path path = folder_ / (std::string("mess") + extension);
    WriteMesh(mesh, path);
    const TriangleMesh read = ReadMesh(path);
    EXPECT_EQ(read.vertices, mesh.vertices);
    EXPECT_EQ(read.faces, mesh.faces);
  }
}

TEST_F(MeshIo, ReadsObjAsOtherProgramsWriteIt) {
  const MeshFile file = ReadMeshFile(Write("cube.obj",
                                           "# Blender v3.4.1 OBJ File\r\n"
                                           "mtllib /dev/zero\r\n"
                                           "o Cube\r\n"
                                           "v 1.000000 1.000000 -1.000000 0.5 0.5 0.5\r\n"
                                           "v  1 -1 -1\r\n"
                                           "v\t1 1 1e0\r\n"
                                           "v +1 -1 1\r\n"
                                           "v -1 1 -1\r\nv -1 -1 -1\r\nv -1 1 1\r\nv -1 -1 1\r\n"
                                           "vt 0.625 0.5\r\nvt broken\r\n"
                                           "vn 0 1 0\r\n"
                                           "usemtl Material\r\ns off\r\ng group\r\n"
                                           "f 1/1/1 5/1/1 7/1/1 3/1/1\r\n"
                                           "f 4//1 3//1 7//1 8//1 # with a comment 99\r\n"
                                           "f 8/1 7/1 5/1 6/1\r\n"
                                           "f -3 -7 -5 -1\r\n"  // 6 2 4 8
                                           "f 2 1 3 4  \r\n"
                                           "\r\n"
                                           "   f 6 5 1 2"));  // no newline at the end
  EXPECT_EQ(file.mesh.NumVertices(), 8);
  EXPECT_EQ(file.mesh.NumFaces(), 12);
  EXPECT_THAT(file.notes, ElementsAre(HasSubstr("6 of 6 faces")));
  const MeshReport report = CheckMesh(file.mesh);
  EXPECT_TRUE(report.watertight);
  EXPECT_NEAR(report.volume_m3, 8.0, 1e-12);
}

TEST_F(MeshIo, KeepsDoublePrecisionOfText) {
  const TriangleMesh mesh =
      ReadMesh(Write("fine.obj", "v 1000.123456789012 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n"));
  EXPECT_EQ(mesh.vertices(0, 0), 1000.123456789012);
}

TEST_F(MeshIo, ReadsPlyWithMoreThanASurfaceInIt) {
  const TriangleMesh mesh = ReadMesh(
      Write("scan.ply",
            "ply\r\nformat ascii 1.0\r\ncomment made by a scanner\r\nobj_info none\r\n"
            "element camera 1\r\nproperty float focal\r\nproperty list uchar float pose\r\n"
            "element vertex 4\r\nproperty double nx\r\nproperty double x\r\nproperty double y\r\n"
            "property double z\r\nproperty uchar red\r\nproperty list uchar int seen_by\r\n"
            "element face 1\r\nproperty uchar flags\r\nproperty list uint8 uint32 vertex_index\r\n"
            "property list uchar float texcoord\r\n"
            "element edge 1\r\nproperty int vertex1\r\nproperty int vertex2\r\nend_header\r\n"
            "35 2 0.5 0.25\r\n"
            "9 0 0 0 255 0\r\n9 1 0 0 255 2 4 5\r\n9 1 1.0000000001 0 255 1 4\r\n9 0 1 0 255 0\r\n"
            "1 4 0 1 2 3 2 0.5 0.5\r\n"
            "0 1\r\n"));
  ASSERT_EQ(mesh.NumVertices(), 4);
  EXPECT_EQ(mesh.vertices(1, 2), 1.0000000001);
  Eigen::Matrix3Xi fan(3, 2);
  fan << 0, 0, 1, 2, 2, 3;
  EXPECT_EQ(mesh.faces, fan);
}

TEST_F(MeshIo, ReadsBinaryPlyOfEveryByteOrderAndType) {
  for (const bool big_endian : {false, true}) {
    for (const bool is_double : {false, true}) {
      for (const int id_bytes : {1, 2, 4}) {
        std::string bytes = fmt::format(
            "ply\nformat binary_{}_endian 1.0\nelement vertex 3\nproperty {t} x\nproperty {t} y\n"
            "property {t} z\nelement face 1\nproperty list {c} {i} vertex_indices\nend_header\n",
            big_endian ? "big" : "little", fmt::arg("t", is_double ? "double" : "float"),
            fmt::arg("c", id_bytes == 1 ? "int" : "uchar"),
            fmt::arg("i", id_bytes == 1   ? "uchar"
                          : id_bytes == 2 ? "short"
                                          : "int"));
        for (const double x : {0.0, 0.0, 0.5, 0.25, 0.0, 0.0, 0.0, 1.0, 0.0}) {
          is_double ? Append(bytes, x, big_endian)
                    : Append(bytes, static_cast<float>(x), big_endian);
        }
        id_bytes == 1 ? Append(bytes, std::int32_t{3}, big_endian) : Append(bytes, std::uint8_t{3});
        for (const int id : {2, 0, 1}) {
          if (id_bytes == 1) Append(bytes, static_cast<std::uint8_t>(id));
          if (id_bytes == 2) Append(bytes, static_cast<std::int16_t>(id), big_endian);
          if (id_bytes == 4) Append(bytes, std::int32_t{id}, big_endian);
        }
        const TriangleMesh mesh = ReadMesh(Write("types.ply", bytes));
        EXPECT_EQ(mesh.vertices.col(0), Eigen::Vector3d(0, 0, 0.5));
        EXPECT_EQ(mesh.vertices.col(2), Eigen::Vector3d(0, 1, 0));
        EXPECT_EQ(mesh.faces.col(0), Eigen::Vector3i(2, 0, 1));
        // Nothing may be left off the end.
        bytes.pop_back();
        Refusal("types.ply", bytes);
      }
    }
  }
}

TEST_F(MeshIo, ReadsOffWithCommentsColorsAndPolygons) {
  const TriangleMesh mesh = ReadMesh(Write("house.off",
                                           "# a house\nCOFF # with colors\n5 2 0\n\n# roof\n"
                                           "0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n1 1 0 0 0 0 1\n"
                                           "0 1 0 0 0 0 1\n0.5 0.5 1 0 0 0 1\n"
                                           "4 0 1 2 3 0.5 0.5 0.5\n3 0 1 4\n"));
  EXPECT_EQ(mesh.NumVertices(), 5);
  EXPECT_EQ(mesh.NumFaces(), 3);
  EXPECT_EQ(mesh.vertices.col(4), Eigen::Vector3d(0.5, 0.5, 1.0));
}

TEST_F(MeshIo, SplitsAPolygonOfManyCornersWithoutAHub) {
  for (const int corners : {64, 65, 1000, 100'000}) {
    std::string text, face = "f";
    for (int i = 0; i < corners; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / corners;
      text += fmt::format("v {:.12f} {:.12f} 0\n", std::cos(angle), std::sin(angle));
      face += fmt::format(" {}", i + 1);
    }
    const TriangleMesh mesh = ReadMesh(Write("disc.obj", text + face + "\n"));
    ASSERT_EQ(mesh.NumFaces(), corners - 2);
    double area = 0.0;
    std::vector<int> faces_at(static_cast<std::size_t>(corners), 0);
    for (Eigen::Index f = 0; f < mesh.NumFaces(); ++f) {
      const auto corner = [&](int k) { return mesh.vertices.col(mesh.faces(k, f)); };
      const Eigen::Vector3d u = corner(1) - corner(0), v = corner(2) - corner(0);
      area += 0.5 * (u.x() * v.y() - u.y() * v.x());
      for (int k = 0; k < 3; ++k) ++faces_at[static_cast<std::size_t>(mesh.faces(k, f))];
    }
    EXPECT_NEAR(area, 0.5 * corners * std::sin(2.0 * std::numbers::pi / corners), 1e-6);
    EXPECT_LE(*std::ranges::max_element(faces_at), std::max(64, 40));
  }
}

TEST_F(MeshIo, ReadsTextAndBinaryStl) {
  const std::string text =
      "solid an outer part\n  facet normal 0 0 1\n    outer loop\n      vertex 0 0 0\n      vertex "
      "1 0 0\n"
      "      vertex 0 1 0\n    endloop\n  endfacet\n  facet normal 0 0 1\n    outer loop\n"
      "      vertex 1 0 0\n      vertex 1 1 0\n      vertex 0 1 0\n    endloop\n  endfacet\n"
      "endsolid name\n";
  TriangleMesh mesh = ReadMesh(Write("text.stl", text));
  EXPECT_EQ(mesh.NumVertices(), 4);
  EXPECT_EQ(mesh.NumFaces(), 2);

  // SolidWorks begins the header of binary files with "solid" too.
  WriteMesh(mesh, folder_ / "binary.stl");
  std::string bytes = ReadFile(folder_ / "binary.stl");
  std::memcpy(bytes.data(), "solid facet", 11);
  mesh = ReadMesh(Write("binary.stl", bytes));
  EXPECT_EQ(mesh.NumVertices(), 4);
  EXPECT_EQ(mesh.NumFaces(), 2);
}

TEST_F(MeshIo, ReadsLinesHoweverTheyEnd) {
  const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
  const TriangleMesh expected = ReadMesh(Write("plain.obj", square));
  const auto with_ends = [&](std::string text, std::string_view end) {
    std::string out;
    for (const char c : text) c == '\n' ? out += end : out += c;
    return out;
  };
  for (const std::string& text :
       {with_ends(square, "\r"), with_ends(square, "\r\n"), "\xef\xbb\xbf" + square,
        square.substr(0, square.size() - 1),
        // Continued lines, as Rhino writes them; a comment is none.
        std::string(
            "# C:\\meshes\\\nv 0 \\\n0 0\nv 1 0 0\nv 1 1 \\ \r\n \\\n0\nv 0 1 0\nf 1 \\\n2\\\n 3 "
            "4 \\\n\n")}) {
    const TriangleMesh mesh = ReadMesh(Write("other.obj", text));
    EXPECT_EQ(mesh.vertices, expected.vertices) << text;
    EXPECT_EQ(mesh.faces, expected.faces) << text;
  }
  // Lines keep their numbers.
  EXPECT_THAT(Refusal("a.obj", "v 0 \\\n0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), HasSubstr("a.obj:5"));

  const std::string off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_EQ(ReadMesh(Write("cr.off", with_ends(off, "\r"))).NumFaces(), 1);
  // ModelNet has the counts behind the magic.
  EXPECT_EQ(ReadMesh(Write("glued.off", "OFF3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")).NumFaces(), 1);
  EXPECT_EQ(ReadMesh(Write("cr.ply", with_ends(kPlyTriangle, "\r"))).NumFaces(), 1);
  const std::string stl =
      "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
      "endfacet\nendsolid\n";
  EXPECT_EQ(ReadMesh(Write("cr.stl", with_ends(stl, "\r"))).NumFaces(), 1);
  // Of a binary file numbers follow the header: 0x0a may be the first.
  std::string binary =
      "ply\rformat binary_little_endian 1.0\relement vertex 3\rproperty uchar x\rproperty uchar y\r"
      "property uchar z\relement face 1\rproperty list uchar uchar vertex_indices\rend_header\r";
  for (const int c : {10, 0, 0, 13, 0, 0, 0, 10, 0, 3, 0, 1, 2}) binary += static_cast<char>(c);
  const TriangleMesh three = ReadMesh(Write("binary.ply", binary));
  EXPECT_EQ(three.vertices(0, 0), 10.0);
  EXPECT_EQ(three.vertices(0, 1), 13.0);
}

TEST_F(MeshIo, ReadsTheCasesOfText) {
  const fs::path cases = HOLDFAST_SOURCE_DIR "/tests/fixtures/cases/mesh_text";
  EXPECT_GT(ReadMesh(cases / "continued.obj").NumFaces(), 1000);
  const MeshFile trailing = ReadMeshFile(cases / "trailing.stl");
  EXPECT_GT(trailing.mesh.NumFaces(), 1000);
  EXPECT_THAT(trailing.notes, ElementsAre(HasSubstr("7 bytes after the triangles were not read")));
}

TEST_F(MeshIo, ReadsPlyStrips) {
  // Two strips of a square and one over, and a corner given twice that turns nothing but the strip.
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float "
      "z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 0 0\n";
  const TriangleMesh mesh = ReadMesh(Write("strips.ply", header + "10 0 1 2 3 -1 3 1 1 4 3\n"));
  ASSERT_EQ(mesh.NumFaces(), 3);
  for (Eigen::Index f = 0; f < 3; ++f) EXPECT_NEAR(FaceCross(mesh, f).norm(), 1.0, 1e-12);
  EXPECT_GT(FaceCross(mesh, 0).z(), 0.0);
  EXPECT_GT(FaceCross(mesh, 1).z(), 0.0);
  EXPECT_THAT(Refusal("a.ply", header + "3 0 1 5\n"), HasSubstr("vertex 5 of 5"));
  EXPECT_THAT(Refusal("a.ply", header + "9 0 1 2\n"), HasSubstr("longer than the file"));
}

// A box in a node that scales, turns and moves it, in another; a mirrored copy; one outside of the
// scene; a strip.
TEST_F(MeshIo, ReadsGltfAsItsNodesPlaceIt) {
  std::string numbers;
  const TriangleMesh box = Box({0, 0, 0}, {1, 1, 1});
  for (const double x : box.vertices.reshaped()) Append(numbers, static_cast<float>(x));
  for (const int id : box.faces.reshaped()) Append(numbers, static_cast<std::uint16_t>(id));
  for (const int id : {0, 1, 2, 3}) Append(numbers, static_cast<std::uint16_t>(id));
  Write("box.bin", numbers);
  const std::string scene = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,2,4]}],
    "nodes":[{"translation":[0,0,1],"scale":[2,2,2],"children":[1]},
             {"mesh":0,"translation":[1,0,0],"rotation":[0,0,0.7071067811865476,0.7071067811865476]},
             {"mesh":0,"scale":[-1,1,1]},{"mesh":0},{"mesh":1,"translation":[0,9,0]}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]},
              {"primitives":[{"attributes":{"POSITION":0},"indices":2,"mode":5}]}],
    "buffers":[{"uri":"box.bin","byteLength":176}],
    "bufferViews":[{"buffer":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":72},
                   {"buffer":0,"byteOffset":168,"byteLength":8}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3"},
                 {"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"},
                 {"bufferView":2,"componentType":5123,"count":4,"type":"SCALAR"}]})";
  const MeshFile file = ReadMeshFile(Write("scene.gltf", scene));
  EXPECT_THAT(file.notes, ElementsAre(HasSubstr("3 meshes are joined")));
  ASSERT_EQ(file.mesh.NumFaces(), 12 + 12 + 2);
  // Parents come before children: the mirrored box, which faces outwards all the same, the strip.
  EXPECT_NEAR(SignedVolume({file.mesh.vertices, file.mesh.faces.leftCols(12)}), 1.0, 1e-6);
  EXPECT_EQ(file.mesh.vertices.leftCols(8).row(0).minCoeff(), -1.0);
  EXPECT_EQ(file.mesh.vertices.row(1).maxCoeff(), 9.0 + 1.0);
  const Eigen::Matrix3Xd last = file.mesh.vertices.rightCols(8);
  EXPECT_LT((last.rowwise().minCoeff() - Eigen::Vector3d(0, 0, 1)).norm(), 1e-6);
  EXPECT_LT((last.rowwise().maxCoeff() - Eigen::Vector3d(2, 2, 3)).norm(), 1e-6);
  EXPECT_NEAR(SignedVolume({file.mesh.vertices, file.mesh.faces.rightCols(12)}), 8.0, 1e-5);

  std::string points = scene;
  for (std::size_t at; (at = points.find("\"indices\"")) != std::string::npos;) {
    points.replace(at, 9, "\"mode\":0,\"ignored\"");
  }
  EXPECT_THAT(Refusal("points.gltf", points.replace(points.find("\"mode\":5"), 8, "\"x\":5")),
              HasSubstr("has no triangles"));
  EXPECT_THROW(WriteMesh(box, folder_ / "out.glb"), Error);
}

TEST_F(MeshIo, RefusesWhatIsNoFile) {
  EXPECT_THAT(RefusalOf(folder_ / "missing.obj"), HasSubstr("does not exist"));
  fs::create_directories(folder_ / "folder.ply");
  EXPECT_THAT(RefusalOf(folder_ / "folder.ply"), HasSubstr("folder"));
  EXPECT_THAT(Refusal("mesh.fbx", "x"), AllOf(HasSubstr(".fbx"), HasSubstr(".obj, .ply")));
  EXPECT_THAT(Refusal("mesh", "x"), HasSubstr("no extension"));
  for (const char* name : {"a.obj", "a.ply", "a.stl", "a.off"}) {
    EXPECT_THAT(Refusal(name, ""), HasSubstr("is empty"));
    EXPECT_THAT(Refusal(name, "\n"), Not(HasSubstr("was read")));
  }
}

TEST_F(MeshIo, RefusesBadNumbersAndIdsWithTheirLine) {
  const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const std::string off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n";
  const std::string ply = std::string(kPlyHeader) + "0 0 0\n1 0 0\n0 1 0\n";
  struct Case {
    const char* name;
    std::string content, message;
  };
  const Case cases[] = {
      {"a.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "a.obj:2"},
      {"a.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "not finite"},
      {"a.obj", "v 0 0 0\nv 1 1e999 0\nv 0 1 0\nf 1 2 3\n", "not finite"},
      {"a.obj", "v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.obj:1"},
      {"a.obj", "v 0 zero 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "'zero'"},
      {"a.obj", three + "f 1 2 4\n", "a.obj:4"},
      {"a.obj", three + "f 1 2 4\n", "vertex 3 of 3"},
      {"a.obj", three + "f 1 2 0\n", "vertex 0"},
      {"a.obj", three + "f 1 2 -4\n", "a.obj:4"},
      {"a.obj", three + "f 1 2 99999999999999999999\n", "a.obj:4"},
      {"a.obj", three + "f 1 2 x\n", "'x'"},
      {"a.obj", three + "f 1 2\n", "fewer than three"},
      {"a.obj", three + "f 1 1 1\n", "no face"},
      {"a.obj", three, "has no faces"},
      {"a.obj", "f 1 2 3\n", "vertex 0 of 0"},
      {"a.obj", "Hello, world\n", "does not look like"},
      {"a.off", off + "3 0 1 3\n", "a.off:6"},
      {"a.off", off + "3 0 1 3\n", "vertex 3"},
      {"a.off", off + "3 0 1 -1\n", "vertex -1"},
      {"a.off", off + "3 0 1\n", "missing"},
      {"a.off", off + "2000000000 0 1\n", "number of corners"},
      {"a.off", off, "0 of 1 faces"},
      {"a.off", "OFF\n3 1 0\n0 0 inf\n1 0 0\n0 1 0\n3 0 1 2\n", "not finite"},
      {"a.off", "OFF BINARY\n3 1 0\n", "binary"},
      {"a.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "has no faces"},
      {"a.ply", std::string(kPlyHeader) + "0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n", "vertex 1"},
      {"a.ply", std::string(kPlyHeader) + "0 0 0\n1 0 x\n0 1 0\n3 0 1 2\n", "'x'"},
      {"a.ply", ply + "3 0 1 3\n", "vertex 3 of 3"},
      {"a.ply", ply + "3 0 1 -2\n", "vertex -2"},
      {"a.ply", ply + "3 0 1\n", "ends within"},
      {"a.ply", ply + "4000000000 0 1 2\n", "longer than the file"}};
  for (const Case& of : cases) {
    EXPECT_THAT(Refusal(of.name, of.content), HasSubstr(of.message)) << of.content;
  }
}

TEST_F(MeshIo, RefusesHeadersThatPromiseTooMuch) {
  EXPECT_THAT(Refusal("a.off", "OFF\n2000000000 2000000000 0\n0 0 0\n"), HasSubstr("promises"));
  EXPECT_THAT(Refusal("a.off", "OFF\n-3 1 0\n0 0 0\n"), HasSubstr("number of vertices"));
  EXPECT_THAT(Refusal("a.off", "OFF\n99999999999999999999 1 0\n"), HasSubstr("missing"));
  for (const char* count :
       {"1000000000", "18446744073709551615", "99999999999999999999", "-1", "x"}) {
    for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
      for (const char* element : {"vertex 3", "face 1"}) {
        std::string ply = kPlyTriangle;
        ply.replace(ply.find("ascii"), 5, format);
        const std::size_t number = ply.find(element) + std::string(element).size() - 1;
        ply.replace(number, 1, count);
        EXPECT_THAT(Refusal("a.ply", ply), HasSubstr("header"));
      }
    }
  }
  std::string stl(84, ' ');
  const std::uint32_t count = 4'000'000'000u;
  std::memcpy(stl.data() + 80, &count, 4);
  EXPECT_THAT(Refusal("a.stl", stl), HasSubstr("promises 4000000000"));
  EXPECT_THAT(Refusal("a.stl", std::string(84, '\0')), HasSubstr("no faces"));
  EXPECT_THAT(Refusal("a.stl", "solid x\nendsolid x\n"), HasSubstr("no faces"));
}

TEST_F(MeshIo, RefusesOddPlyHeaders) {
  const auto with = [](const char* from, const char* to) {
    std::string ply = kPlyTriangle;
    ply.replace(ply.find(from), std::strlen(from), to);
    return ply;
  };
  EXPECT_NO_THROW(ReadMesh(Write("fine.ply", kPlyTriangle)));
  for (const std::string& header :
       {with("ply\n", "plx\n"), with("ascii", "ebcdic"), with("format ascii 1.0\n", ""),
        with("property float z\n", ""), with("property float z", "property list uchar float z"),
        with("property float z", "property quaternion z"), with("list uchar int", "list float int"),
        with("vertex_indices", "corners"), with("element face 1", "element face 0"),
        with("element face 1\nproperty list uchar int vertex_indices\n", ""),
        with("element vertex 3\n", ""), with("element face 1\n", "element vertex 3\n"),
        with("end_header\n", ""), std::string("ply\n"), std::string("ply"),
        "ply\nformat ascii 1.0\n" + std::string(100'000, 'x'),
        std::string("ply\nformat ascii 1.0\nelement vertex 3\nelement face 1\nend_header\n")}) {
    SCOPED_TRACE(header.substr(0, 300));
    Refusal("a.ply", header);
  }
}

TEST_F(MeshIo, ReadsOnSeveralThreads) {
  WriteMesh(Sphere(0.05, 3), folder_ / "sphere.ply");
  WriteMesh(Torus(0.05, 0.02, 20, 10), folder_ / "torus.obj");
  std::vector<int> good(4, 0);
  {
    std::vector<std::jthread> threads;
    for (int& mine : good) {
      threads.emplace_back([&] {
        for (int i = 0; i < 20; ++i) {
          mine += ReadMesh(folder_ / "sphere.ply").NumVertices() == 258;
          mine += ReadMesh(folder_ / "torus.obj").NumVertices() == 200;
        }
      });
    }
  }
  EXPECT_THAT(good, ::testing::Each(40));
}

TEST_F(MeshIo, SaysNothingItself) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  for (const char* extension : {".obj", ".ply", ".stl", ".off"}) {
    const fs::path path = folder_ / (std::string("quiet") + extension);
    WriteMesh(Sphere(0.05, 1), path);
    ReadMesh(path);
  }
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST_F(MeshIo, RefusesToWriteWhatCannotBeRead) {
  const TriangleMesh box = Box({0, 0, 0}, {1, 1, 1});
  EXPECT_THROW(WriteMesh(box, folder_ / "box.fbx"), Error);
  std::ofstream(folder_ / "file") << "no folder";
  EXPECT_THROW(WriteMesh(box, folder_ / "file" / "box.ply"), Error);
  fs::remove(folder_ / "file");
  EXPECT_THROW(WriteMesh(TriangleMesh{}, folder_ / "empty.ply"), Error);
  TriangleMesh bad = box;
  bad.faces(0, 0) = 8;
  EXPECT_THROW(WriteMesh(bad, folder_ / "bad.ply"), Error);
  bad = box;
  bad.vertices(0, 0) = 1e300;
  EXPECT_THROW(WriteMesh(bad, folder_ / "bad.ply"), Error);
  EXPECT_TRUE(fs::is_empty(folder_.Path()));
}

}  // namespace
}  // namespace holdfast
