// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_writer.h"

#include <gtest/gtest.h>

#include "geometry/mesh/mesh_topology.h"
#include "geometry/rotation.h"
#include "tests/support/glb_file.h"
#include "tests/support/moving_clip.h"
#include "tests/support/synthetic_body.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using testing::GlbFile;
using testing::MakeMovingClip;
using testing::TemporaryFolder;
using testing::Tetrahedron;

Eigen::Matrix3Xd YUp(const Eigen::Matrix3Xd& z_up) {
  Eigen::Matrix3Xd result(3, z_up.cols());
  result << z_up.row(0), z_up.row(2), -z_up.row(1);
  return result;
}

double Furthest(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  EXPECT_EQ(a.cols(), b.cols());
  return (a - b).colwise().norm().maxCoeff();
}

// The demanding one: what a viewer shows is the body model, to a tenth of a millimeter.
TEST(GltfWriter, ShowsTheBodyModelsSurfaceJointsAndObject) {
  const TemporaryFolder folder;
  const BodySurface surface(BodyModel::Default());
  const Clip clip = MakeMovingClip(25, 3);
  const TriangleMesh object = Tetrahedron();
  const SkinReport report = WriteGlb(clip, surface, &object, {}, folder / "a.glb");
  EXPECT_GT(report.morph_targets, 0);
  EXPECT_LE(report.corrective_error_m, 2e-5);

  const GlbFile file(folder / "a.glb");
  const ShadedMesh shaded = SplitAtCreases(object);
  BodyState state;
  for (const int t : {0, 11, 24}) {
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    EXPECT_LT(Furthest(file.Vertices(file.Node("body"), t), YUp(state.vertices)), 1e-4);
    const auto world = file.Pose(t);
    for (int j = 0; j < kNumJoints; ++j) {
      const Eigen::Vector3d joint = world[file.Node(std::string(kJointNames[j]))].translation();
      EXPECT_LT(Furthest(joint, YUp(state.joints.col(j))), 1e-5) << kJointNames[j];
    }
    const Eigen::Matrix3Xd placed =
        (ExpSO3(clip.object->orient.col(t)) * shaded.mesh.vertices).colwise() +
        clip.object->trans.col(t);
    EXPECT_LT(Furthest(file.Vertices(file.Node("thing"), t), YUp(placed)), 1e-5);
    EXPECT_NEAR(file.Times()(t), t / clip.frame_rate, 1e-6);
  }
}

// Blender clamps a target's weight to [0, 1], and makes an armature of the joints' parent: no
// object of the scene may be there for the file's sake only.
TEST(GltfWriter, MorphWeightsLieInZeroToOneAndNodesAreThings) {
  const TemporaryFolder folder;
  const TriangleMesh object = Tetrahedron();
  WriteGlb(MakeMovingClip(25, 3), BodySurface(BodyModel::Default()), &object, {}, folder / "a.glb");
  const GlbFile file(folder / "a.glb");
  int channels = 0;
  for (const auto& channel : file.Json()["animations"][0]["channels"]) {
    if (channel["target"]["path"] != "weights") continue;
    ++channels;
    const auto& sampler = file.Json()["animations"][0]["samplers"][channel["sampler"].get<int>()];
    const Eigen::MatrixXd weights = file.Accessor(sampler["output"]);
    EXPECT_GE(weights.minCoeff(), 0.0);
    EXPECT_LE(weights.maxCoeff(), 1.0);
  }
  EXPECT_EQ(channels, 1);
  std::vector<std::string> top;
  for (const int node : file.Json()["scenes"][0]["nodes"]) {
    top.push_back(file.Json()["nodes"][node]["name"]);
  }
  EXPECT_EQ(top, (std::vector<std::string>{"body", "thing"}));
  EXPECT_EQ(file.Json()["nodes"].size(), 2u + kNumJoints);
}

TEST(GltfWriter, ShowsTheTable) {
  const TemporaryFolder folder;
  Clip clip = MakeMovingClip(3, 3);
  clip.table = clip.object;
  clip.table->name = "desk";
  clip.table->trans.array() += 0.3;
  const TriangleMesh table = Tetrahedron();
  clip.table->surface = std::make_shared<const TriangleMesh>(table);
  const GlbOptions options;
  WriteGlb(clip, BodySurface(BodyModel::Default()), nullptr, options, folder / "a.glb");
  const GlbFile file(folder / "a.glb");
  const ShadedMesh shaded = SplitAtCreases(table);
  const Eigen::Matrix3Xd placed =
      (ExpSO3(clip.table->orient.col(2)) * shaded.mesh.vertices).colwise() +
      clip.table->trans.col(2);
  EXPECT_LT(Furthest(file.Vertices(file.Node("desk"), 2), YUp(placed)), 1e-5);
}

TEST(GltfWriter, WithoutCorrectivesTellsHowFarOffTheSkinIs) {
  const TemporaryFolder folder;
  const BodySurface surface(BodyModel::Default());
  const Clip clip = MakeMovingClip(8, 4);
  GlbOptions options;
  options.correctives = false;
  const SkinReport report = WriteGlb(clip, surface, nullptr, options, folder / "a.glb");
  EXPECT_EQ(report.morph_targets, 0);
  EXPECT_GT(report.corrective_error_m, 1e-4);
  const GlbFile file(folder / "a.glb");
  BodyState state;
  double worst = 0;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    worst = std::max(worst, Furthest(file.Vertices(file.Node("body"), t), YUp(state.vertices)));
  }
  EXPECT_GT(worst, 1e-4);  // the test above would see it
  EXPECT_LE(worst, report.corrective_error_m + 1e-5);
  EXPECT_EQ(file.Json()["meshes"].size(), 1u);  // no object mesh, no object
}

// Bodies whose vertices hang on more than four joints keep all their weights.
TEST(GltfWriter, KeepsEightWeightsWhereFourWouldNotDo) {
  const TemporaryFolder folder;
  testing::SyntheticBody body(40, 12, 9);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0.05, 1);
  std::fill(body.weights.begin(), body.weights.end(), 0.0);
  for (int v = 0; v < body.num_vertices; ++v) {
    double sum = 0;
    for (int k = 0; k < 7; ++k) {
      sum += body.weights[v * kNumJoints + (v * 11 + 7 * k) % kNumJoints] = uniform(random);
    }
    for (int j = 0; j < kNumJoints; ++j) body.weights[v * kNumJoints + j] /= sum;
  }
  body.Write(folder / "body.npz");
  const BodySurface surface(BodyModel::Load(folder / "body.npz"));
  const Clip clip = MakeMovingClip(6, 5);
  const SkinReport report = WriteGlb(clip, surface, nullptr, {}, folder / "a.glb");
  EXPECT_EQ(report.influences, 8);
  const GlbFile file(folder / "a.glb");
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    EXPECT_LT(Furthest(file.Vertices(file.Node("body"), t), YUp(state.vertices)), 1e-4);
  }
}

TEST(GltfWriter, QuaternionsTurnTheShortWay) {
  const TemporaryFolder folder;
  const BodySurface surface(BodyModel::Default());
  const Clip clip = MakeMovingClip(60, 6);  // root and object turn by more than pi
  const TriangleMesh object = Tetrahedron();
  WriteGlb(clip, surface, &object, {}, folder / "a.glb");
  const GlbFile file(folder / "a.glb");
  const auto& animation = file.Json()["animations"][0];
  int rotations = 0;
  for (const auto& channel : animation["channels"]) {
    if (channel["target"]["path"] != "rotation") continue;
    ++rotations;
    const Eigen::MatrixXd q =
        file.Accessor(animation["samplers"][channel["sampler"].get<int>()]["output"]);
    for (int t = 1; t < q.cols(); ++t) EXPECT_GT(q.col(t).dot(q.col(t - 1)), 0.9);
  }
  EXPECT_EQ(rotations, kNumJoints + 1);
}

TEST(GltfWriter, SameClipGivesTheSameBytesOnAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const BodySurface surface(BodyModel::Default());
  const Clip clip = MakeMovingClip(12, 7);
  GlbOptions options;
  WriteGlb(clip, surface, nullptr, options, folder / "one.glb");
  options.threads = 3;
  WriteGlb(clip, surface, nullptr, options, folder / "three.glb");
  EXPECT_EQ(ReadFile(folder / "one.glb"), ReadFile(folder / "three.glb"));
}

TEST(CreaseNormals, KeepBoxEdgesSharpAndGentleSurfacesWhole) {
  const ShadedMesh sharp = SplitAtCreases(Tetrahedron());
  EXPECT_EQ(sharp.mesh.NumVertices(), 12);  // three flat corners at each of four
  const ShadedMesh smooth = SplitAtCreases(Tetrahedron(), 3.2);
  EXPECT_EQ(smooth.mesh.NumVertices(), 4);
  EXPECT_LT((smooth.normals - VertexNormals(Tetrahedron())).norm(), 1e-12);
  for (const ShadedMesh* shaded : {&sharp, &smooth}) {
    EXPECT_NEAR(shaded->normals.colwise().norm().minCoeff(), 1, 1e-12);
    for (Eigen::Index k = 0; k < 12; ++k) {
      EXPECT_EQ(shaded->mesh.vertices.col(shaded->mesh.faces(k)),
                Tetrahedron().vertices.col(Tetrahedron().faces(k)));
    }
  }
}

TEST(CreaseNormals, FacesWithoutAreaGetAUnitNormal) {
  TriangleMesh mesh = Tetrahedron();
  mesh.faces.conservativeResize(3, 5);
  mesh.faces.col(4) << 1, 1, 1;
  EXPECT_NEAR(SplitAtCreases(mesh).normals.colwise().norm().minCoeff(), 1, 1e-12);
}

}  // namespace
}  // namespace holdfast
