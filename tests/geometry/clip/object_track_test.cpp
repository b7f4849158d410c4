// SPDX-License-Identifier: MIT
#include <numbers>

#include <gtest/gtest.h>

#include "geometry/clip/clip.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/rotation.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

// A turn of 0.4 rad a frame, through more than half a circle.
TEST(ObjectTrack, PosesComeBackAndAnglesGoOn) {
  constexpr int kFrames = 12;
  ObjectTrack track;
  track.trans.setZero(3, kFrames);
  track.orient.setZero(3, kFrames);
  const auto pose = [](int t) {
    return RigidTransform(ExpSO3(Eigen::Vector3d(0.0, 0.0, 0.4 * t)),
                          Eigen::Vector3d(t, 2.0, -1.0));
  };
  for (int t = 0; t < kFrames; ++t) track.SetPose(t, pose(t));
  for (int t = 0; t < kFrames; ++t) {
    EXPECT_LT((track.Pose(t).matrix() - pose(t).matrix()).norm(), 1e-12) << t;
    EXPECT_NEAR(track.orient(2, t), 0.4 * t, 1e-9) << t;  // no jump at half a turn
  }
  EXPECT_GT(track.orient(2, kFrames - 1), std::numbers::pi);
}

TEST(ObjectTrack, FirstFrameStaysNearWhatStandsThere) {
  ObjectTrack track;
  track.trans.setZero(3, 1);
  track.orient = Eigen::Vector3d(0.0, 0.0, 6.0);
  track.SetPose(0, RigidTransform(ExpSO3(Eigen::Vector3d(0.0, 0.0, 6.1)), Eigen::Vector3d::Zero()));
  EXPECT_NEAR(track.orient(2, 0), 6.1, 1e-9);
}

// Computed apart, by the lines of docs/formats.md.
TEST(MeshChecksum, IsTheSameOnEveryMachine) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0.0, 0.1, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, -0.0;
  mesh.faces = Eigen::Vector3i(0, 1, 2);
  EXPECT_EQ(MeshChecksum(mesh), "a648cea768d977f5");
  mesh.vertices(0, 1) += 1e-10;  // less than a file holds
  EXPECT_EQ(MeshChecksum(mesh), "a648cea768d977f5");
  mesh.vertices(0, 1) += 1e-7;
  EXPECT_NE(MeshChecksum(mesh), "a648cea768d977f5");
}

TEST(MeshChecksum, TellsAClipsMeshFromAnother) {
  const testing::TemporaryFolder folder;
  TriangleMesh mesh = testing::Sphere(0.05, 2);
  Clip clip;
  clip.trans.setZero(3, 1);
  clip.pose.assign(1, JointPose::Zero());
  clip.object.emplace();
  clip.object->trans.setZero(3, 1);
  clip.object->orient.setZero(3, 1);
  clip.object->mesh = "object.ply";
  WriteClip(clip, mesh, folder / "clip.npz");
  WriteMesh(mesh, folder / "object.ply");
  EXPECT_NO_THROW(
      RequireMeshOf(folder / "clip.npz", ReadMesh(folder / "object.ply"), "object.ply"));
  std::swap(mesh.faces(0, 3), mesh.faces(1, 3));
  EXPECT_THROW(RequireMeshOf(folder / "clip.npz", mesh, "object.ply"), Error);
  EXPECT_TRUE(IsHoldfastClip(NpzReader(folder / "clip.npz").Keys()));
  EXPECT_TRUE(HasOnlyClipArrays(NpzReader(folder / "clip.npz").Keys()));
  WriteClip(clip, folder / "old.npz");
  EXPECT_NO_THROW(RequireMeshOf(folder / "old.npz", mesh, "object.ply"));
}

}  // namespace
}  // namespace holdfast
