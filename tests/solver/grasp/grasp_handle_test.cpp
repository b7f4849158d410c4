// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_handle.h"

#include <algorithm>
#include <filesystem>

#include <gtest/gtest.h>

#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/signed_distance.h"
#include "solver/grasp/grasp.h"
#include "solver/grasp/grasp_handle_placement.h"
#include "tests/support/data_folder.h"
#include "tests/support/hand_scene.h"

namespace holdfast {
namespace {

using testing::DefaultHand;

struct Object {
  explicit Object(const std::filesystem::path& path)
      : mesh(ReadMesh(path.string())), surface(mesh), grid(surface, {.threads = 2}) {}
  explicit Object(const std::string& name)
      : Object(std::filesystem::path(HOLDFAST_MESHES_DIR "/objects") / (name + ".ply")) {}
  TriangleMesh mesh;
  SignedDistance surface;
  DistanceGrid grid;
};

std::vector<Handle> Handles(const Object& object, int threads = 2) {
  return FindHandles(object.grid, threads);
}

// Fits a handle's description to exact distances: material in the bar, a finger's room behind it.
void ExpectBarsWithRoom(const Object& object, const std::vector<Handle>& handles) {
  for (const Handle& handle : handles) {
    EXPECT_NEAR(handle.along.dot(handle.inward), 0.0, 1e-9);
    EXPECT_NEAR(handle.through.norm(), 1.0, 1e-9);
    const Eigen::Vector3d beside = handle.bar + (0.5 * handle.thickness + 0.009) * handle.inward;
    EXPECT_GT(object.surface.Distance(beside), 0.004);
    EXPECT_GT(handle.room, 0.015);
    EXPECT_LT(object.surface.Distance(handle.bar), 0.0035) << "no material in the bar";
  }
}

TEST(FindHandles, SeesTheHandleOfAMug) {
  const Object mug(std::string("mug"));
  const std::vector<Handle> handles = Handles(mug);
  ASSERT_FALSE(handles.empty());
  ExpectBarsWithRoom(mug, handles);
  // It points to +x, its opening to y.
  EXPECT_GT(handles.front().bar.x(), 0.045);
  EXPECT_LT(handles.front().inward.x(), -0.8);
  EXPECT_GT(std::abs(handles.front().through.y()), 0.9);
}

TEST(FindHandles, SeesTheHandleOfATeapot) {
  const Object teapot(std::string("teapot"));
  const std::vector<Handle> handles = Handles(teapot);
  ASSERT_FALSE(handles.empty());
  ExpectBarsWithRoom(teapot, handles);
  EXPECT_LT(handles.front().bar.x(), -0.09);  // away from the spout
}

TEST(FindHandles, SeesHandlesOfScannedObjects) {
  const std::filesystem::path folder = testing::DataFolder() / "objects";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no scanned objects in " << folder;
  for (const char* name : {"025_mug.obj", "019_pitcher_base.obj"}) {
    const Object object(folder / name);
    const std::vector<Handle> handles = Handles(object);
    EXPECT_FALSE(handles.empty()) << name;
    ExpectBarsWithRoom(object, handles);
  }
  for (const char* name : {"002_master_chef_can.obj", "003_cracker_box.obj", "011_banana.obj"}) {
    EXPECT_TRUE(Handles(Object(folder / name)).empty()) << name;
  }
}

TEST(FindHandles, SeesNoneWhereThereIsNoOpening) {
  // A bar alone (hammer, pan), a cup (bowl, glass), a solid.
  for (const char* name : {"apple", "bottle", "wineglass", "hammer"}) {
    EXPECT_TRUE(Handles(Object(std::string(name))).empty()) << name;
  }
}

TEST(FindHandles, TurnsWithTheObjectAndDoesNotDependOnThreads) {
  const Object mug(std::string("mug"));
  const std::vector<Handle> one = Handles(mug, 1), two = Handles(mug, 2);
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].bar, two[i].bar);
    EXPECT_EQ(one[i].along, two[i].along);
  }
  TriangleMesh turned = mug.mesh;
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, -0.5).normalized()).toRotationMatrix();
  turned.vertices = R * turned.vertices;
  const SignedDistance surface(turned);
  const std::vector<Handle> of_turned = FindHandles(DistanceGrid(surface, {.threads = 2}), 2);
  ASSERT_FALSE(of_turned.empty());
  EXPECT_GT((R.transpose() * of_turned.front().bar).x(), 0.04);
}

TEST(PassesThrough, NeedsACrossingOfTheOpening) {
  const Handle handle{Eigen::Vector3d::Zero(),
                      Eigen::Vector3d::UnitZ(),
                      Eigen::Vector3d::UnitX(),
                      Eigen::Vector3d::UnitY(),
                      0.01,
                      0.01,
                      0.03,
                      -0.02,
                      0.02};
  Eigen::Matrix3Xd chain(3, 2);
  chain << 0.02, 0.02, -0.01, 0.01, 0.0, 0.0;
  EXPECT_TRUE(PassesThrough(handle, chain));
  chain.row(0).setConstant(-0.02);  // outside the bar
  EXPECT_FALSE(PassesThrough(handle, chain));
  chain.row(0).setConstant(0.05);  // on the far side
  EXPECT_FALSE(PassesThrough(handle, chain));
  chain.row(0).setConstant(0.02);
  chain.row(2).setConstant(0.05);  // above the opening
  EXPECT_FALSE(PassesThrough(handle, chain));
  chain.row(2).setZero();
  chain.row(1) << -0.02, -0.01;  // not far enough
  EXPECT_FALSE(PassesThrough(handle, chain));
}

class HandleGrasp : public ::testing::TestWithParam<std::pair<const char*, Side>> {};

TEST_P(HandleGrasp, HasFingersOnBothSidesOfTheBarAndNoneInTheObject) {
  const auto& [name, side] = GetParam();
  const Object object{std::string(name)};
  GraspOptions options;
  options.threads = 2;
  options.style = GraspStyle::kHandle;
  GraspReport report;
  const Grasp grasp =
      CloseHand(DefaultHand(side), object.mesh, object.surface, object.grid, options, &report);
  ASSERT_EQ(report.status, GraspStatus::kFound) << report.candidates.front().refused;
  EXPECT_EQ(grasp.style, GraspStyle::kHandle);
  EXPECT_LT(grasp.max_penetration_mm, 2.0);
  EXPECT_LT(grasp.object_in_hand_mm, 3.0);
  EXPECT_LT(grasp.metrics.max_penetration_mm, 2.0);
  EXPECT_TRUE(grasp.fingers_touching[kThumb]);
  const auto through = std::count(grasp.fingers_through.begin(), grasp.fingers_through.end(), true);
  EXPECT_GE(through, 2);

  // A finger that is through starts outside the bar and ends behind it.
  const HandAxes axes(DefaultHand(side));
  HandEvaluation evaluation = AtWrist(DefaultHand(side));
  const HandState& state = evaluation.At(grasp.fingers.data(), false);
  const std::vector<Handle> handles = Handles(object);
  for (int finger = 0; finger < kThumb; ++finger) {
    if (!grasp.fingers_through[finger]) continue;
    const Eigen::Matrix3Xd chain =
        grasp.wrist_from_object.inverse() * FingerChain(axes, state, finger);
    EXPECT_TRUE(std::any_of(handles.begin(), handles.end(), [&](const Handle& handle) {
      return (chain.col(0) - handle.bar).dot(handle.inward) < 0.0 &&
             (chain.col(3) - handle.bar).dot(handle.inward) > 0.0;
    }));
  }
}

INSTANTIATE_TEST_SUITE_P(Objects, HandleGrasp,
                         ::testing::Values(std::pair{"mug", Side::kRight},
                                           std::pair{"teapot", Side::kLeft}),
                         [](const auto& test) { return std::string(test.param.first); });

TEST(CloseHand, SaysSoWhenThereIsNoHandle) {
  const Object apple(std::string("apple"));
  GraspOptions options;
  options.style = GraspStyle::kHandle;
  GraspReport report;
  CloseHand(DefaultHand(Side::kRight), apple.mesh, apple.surface, apple.grid, options, &report);
  EXPECT_EQ(report.status, GraspStatus::kNoHandle);
}

TEST(CloseHand, KeepsToTheStyleAskedFor) {
  const Object mug(std::string("mug"));
  GraspOptions options;
  options.threads = 2;
  options.closings = 60;
  options.refinements = 8;
  for (const GraspStyle style : {GraspStyle::kPower, GraspStyle::kPrecision}) {
    options.style = style;
    EXPECT_EQ(CloseHand(DefaultHand(Side::kRight), mug.mesh, mug.surface, mug.grid, options).style,
              style);
  }
  EXPECT_EQ(StyleByName("handle"), GraspStyle::kHandle);
  EXPECT_EQ(StyleByName("auto"), std::nullopt);
}

}  // namespace
}  // namespace holdfast
