// SPDX-License-Identifier: MIT
#include "geometry/object/load_object.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::testing {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kTwoBoxes =
    std::filesystem::path(HOLDFAST_SOURCE_DIR) / "tests/fixtures/collada/two_boxes.dae";

Eigen::AlignedBox3d BoxOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto vertex : mesh.vertices.colwise()) box.extend(Eigen::Vector3d(vertex));
  return box;
}

// 2 x 4 x 6 cm, and the same turned by a quarter about z, 10 cm along x (make_collada.py).
TEST(LoadObject, ColladaScenesBecomeOneMeshInMeters) {
  LoadedObject object;
  try {
    object = LoadObject(kTwoBoxes.string());
  } catch (const Error& error) {
    if (error.Problem().find("does not include assimp") == std::string::npos) throw;
    GTEST_SKIP() << "built without assimp";
  }
  EXPECT_EQ(object.name, "two_boxes");
  EXPECT_EQ(object.mesh.NumVertices(), 16);
  EXPECT_EQ(object.mesh.NumFaces(), 24);
  const Eigen::AlignedBox3d box = BoxOf(object.mesh);
  EXPECT_LT((box.min() - Eigen::Vector3d(-0.01, -0.02, -0.03)).norm(), 1e-7);
  EXPECT_LT((box.max() - Eigen::Vector3d(0.12, 0.02, 0.03)).norm(), 1e-7);
  EXPECT_NEAR(Eigen::Vector3d(object.mesh.vertices.rowwise().mean()).x(), 0.05, 1e-7);
}

TEST(LoadObject, BrokenColladaIsAnErrorThatNamesTheFile) {
  const TemporaryFolder folder;
  std::ofstream(folder / "empty.dae") << "<COLLADA version=\"1.4.1\"></COLLADA>";
  std::ofstream(folder / "no.dae") << "not xml";
  for (const char* name : {"empty.dae", "no.dae"}) {
    EXPECT_THAT(ErrorText([&] { LoadObject((folder / name).string()); }), HasSubstr(name));
  }
}

constexpr const char* kDrawer = R"(<robot name="cabinet">
<link name="case"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
<link name="drawer"><visual><origin xyz="0 0 0.01"/><geometry><box size="0.1 0.1 0.04"/></geometry></visual>
<visual><geometry><mesh filename="MESH"/></geometry></visual></link>
<joint name="slide" type="prismatic"><parent link="case"/><child link="drawer"/>
<origin xyz="0.3 0 0" rpy="0 0 1.5707963267948966"/><axis xyz="1 0 0"/>
<limit lower="0.05" upper="0.2" effort="1" velocity="1"/></joint></robot>)";

TEST(LoadObject, LinksOfAUrdfAreOneMeshAtTheirNearestToZero) {
  const TemporaryFolder folder;
  std::string text = kDrawer;
  text.replace(text.find("MESH"), 4, "handle.dae");
  std::filesystem::copy_file(kTwoBoxes, folder / "handle.dae");
  std::ofstream(folder / "cabinet.urdf") << text;
  LoadedObject object;
  try {
    object = LoadObject((folder / "cabinet.urdf").string());
  } catch (const Error& error) {
    if (error.Problem().find("does not include") == std::string::npos) throw;
    GTEST_SKIP() << error.Problem();
  }
  EXPECT_EQ(object.name, "cabinet");
  EXPECT_EQ(object.mesh.NumVertices(), 8 + 8 + 16);
  EXPECT_THAT(object.notes, ::testing::Contains(HasSubstr("1 joint of cabinet.urdf stays at 0")));
  // The drawer is turned by a quarter and slides by its lower bound along y.
  const Eigen::AlignedBox3d box = BoxOf(object.mesh);
  EXPECT_LT((box.min() - Eigen::Vector3d(-0.1, -0.1, -0.05)).norm(), 1e-7);
  EXPECT_LT((box.max() - Eigen::Vector3d(0.35, 0.17, 0.05)).norm(), 1e-7);
  std::ofstream(folder / "bare.urdf") << R"(<robot name="bare"><link name="a"/></robot>)";
  EXPECT_THAT(ErrorText([&] { LoadObject((folder / "bare.urdf").string()); }),
              HasSubstr("has no link with a shape"));
}

}  // namespace
}  // namespace holdfast::testing
