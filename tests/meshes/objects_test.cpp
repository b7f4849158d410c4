// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <ostream>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/decimate.h"
#include "geometry/mesh/mesh.h"
#include "geometry/mesh/mesh_check.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/object/load_object.h"
#include "tests/meshes/self_intersection.h"

namespace holdfast {
namespace {

/// What the real thing measures: sorted side lengths of the bounding box in millimeters, the volume
/// of its material in cubic centimeters, and how far the 300-vertex version may be off.
struct Expected {
  std::string name;
  Eigen::Vector3d low_mm;
  Eigen::Vector3d high_mm;
  double low_cm3;
  double high_cm3;
  double coarse_mm;
};

void PrintTo(const Expected& object, std::ostream* out) { *out << object.name; }

const Expected kObjects[] = {
    {"apple", {65, 65, 65}, {90, 90, 90}, 180, 330, 2.0},
    {"banana", {30, 45, 160}, {45, 90, 220}, 80, 180, 2.0},
    {"bottle", {60, 60, 190}, {75, 75, 240}, 450, 650, 3.0},
    {"bowl", {60, 130, 130}, {85, 170, 170}, 90, 250, 3.0},
    {"camera", {80, 80, 120}, {100, 100, 145}, 350, 650, 4.0},
    {"cube", {60, 60, 60}, {60, 60, 60}, 213, 216, 1.0},
    {"cylinder", {50, 50, 120}, {50, 50, 120}, 234, 236, 1.0},
    {"flashlight", {34, 34, 140}, {45, 45, 175}, 70, 150, 2.0},
    {"fryingpan", {55, 180, 350}, {75, 220, 430}, 120, 300, 4.0},
    {"hammer", {28, 95, 300}, {38, 140, 350}, 150, 260, 3.0},
    {"knife", {16, 38, 260}, {28, 55, 310}, 35, 90, 2.0},
    {"lightbulb", {58, 58, 100}, {62, 62, 115}, 120, 190, 2.0},
    {"mug", {75, 85, 105}, {90, 110, 130}, 90, 170, 3.0},
    {"phone", {7, 68, 140}, {12, 80, 165}, 65, 110, 1.5},
    {"sphere", {67, 67, 67}, {67, 67, 67}, 155, 157.5, 1.0},
    {"teapot", {110, 120, 200}, {160, 160, 260}, 900, 1700, 5.0},
    {"toothbrush", {10, 14, 180}, {18, 25, 205}, 10, 25, 2.0},
    {"wineglass", {75, 75, 200}, {90, 90, 230}, 40, 90, 3.0},
};

std::filesystem::path ObjectsFolder() {
  return std::filesystem::path(HOLDFAST_MESHES_DIR) / "objects";
}

void ExpectSound(const TriangleMesh& mesh) {
  const MeshReport report = CheckMesh(mesh);
  EXPECT_TRUE(report.watertight);
  EXPECT_EQ(report.num_components, 1);
  EXPECT_EQ(report.num_duplicate_vertices, 0);
  EXPECT_GT(SignedVolume(mesh), 0.0);
  EXPECT_FALSE(CutsItself(mesh));
}

class ObjectTest : public testing::TestWithParam<Expected> {
 protected:
  TriangleMesh Full() const { return ReadMesh(ObjectsFolder() / (GetParam().name + ".ply")); }
  TriangleMesh Coarse() const { return ReadMesh(ObjectsFolder() / (GetParam().name + "_300.ply")); }
};

TEST_P(ObjectTest, FullResolutionIsSound) {
  const TriangleMesh mesh = Full();
  EXPECT_GE(mesh.NumVertices(), 3000);
  EXPECT_LE(mesh.NumVertices(), 8000);
  ExpectSound(mesh);
}

TEST_P(ObjectTest, CoarseVersionIsSoundAndHas300Vertices) {
  const TriangleMesh mesh = Coarse();
  EXPECT_EQ(mesh.NumVertices(), 300);
  ExpectSound(mesh);
}

TEST_P(ObjectTest, IsFittedWithItsCoarseVersionAtAnyScale) {
  constexpr double kScale = 1.1;
  LoadedObject object = LoadObject(GetParam().name);
  EXPECT_EQ(ForFitting(object, 300, nullptr).vertices, Coarse().vertices);
  const TriangleMesh scaled = ForFitting(LoadObject(GetParam().name, kScale), 300, nullptr);
  EXPECT_TRUE(scaled.vertices.isApprox(kScale * Coarse().vertices, 1e-12));
  object.mesh.vertices.row(0) *= kScale;  // another shape: decimated anew
  EXPECT_FALSE(ForFitting(object, 300, nullptr).vertices.isApprox(Coarse().vertices, 1e-3));
}

TEST_P(ObjectTest, IsTrueToSize) {
  const TriangleMesh mesh = Full();
  Eigen::Vector3d size_mm = 1e3 * Extent(mesh);
  std::sort(size_mm.begin(), size_mm.end());
  constexpr double kSlack = 0.05;  // chords of a round
  for (int k = 0; k < 3; ++k) {
    EXPECT_GE(size_mm[k], GetParam().low_mm[k] - kSlack);
    EXPECT_LE(size_mm[k], GetParam().high_mm[k] + kSlack);
  }
  const double volume_cm3 = 1e6 * SignedVolume(mesh);
  EXPECT_GE(volume_cm3, GetParam().low_cm3);
  EXPECT_LE(volume_cm3, GetParam().high_cm3);
}

TEST_P(ObjectTest, OriginIsTheMiddleOfTheBottom) {
  const TriangleMesh mesh = Full();
  const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff();
  const Eigen::Vector3d high = mesh.vertices.rowwise().maxCoeff();
  EXPECT_NEAR(low.z(), 0.0, 1e-7);
  EXPECT_NEAR(low.x() + high.x(), 0.0, 1e-7);
  EXPECT_NEAR(low.y() + high.y(), 0.0, 1e-7);
}

TEST_P(ObjectTest, CoarseVersionStaysClose) {
  const SurfaceDistance distance = MeasureSurfaceDistance(Full(), Coarse(), 20'000);
  EXPECT_LE(1e3 * distance.hausdorff_forward_m, GetParam().coarse_mm);
  EXPECT_LE(1e3 * distance.hausdorff_backward_m, GetParam().coarse_mm);
}

INSTANTIATE_TEST_SUITE_P(Embedded, ObjectTest, testing::ValuesIn(kObjects),
                         [](const auto& object) { return object.param.name; });

TEST(ObjectsFolderTest, HoldsNothingElseAndStaysSmall) {
  std::set<std::string> expected;
  for (const Expected& object : kObjects) {
    expected.insert(object.name + ".ply");
    expected.insert(object.name + "_300.ply");
  }
  std::set<std::string> found;
  std::uintmax_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(ObjectsFolder())) {
    if (entry.path().extension() != ".ply") continue;
    found.insert(entry.path().filename().string());
    bytes += entry.file_size();
  }
  EXPECT_EQ(found, expected);
  EXPECT_LE(bytes, 6u * 1000u * 1000u);
}

}  // namespace
}  // namespace holdfast
