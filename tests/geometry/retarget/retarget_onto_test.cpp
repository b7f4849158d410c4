// SPDX-License-Identifier: MIT
#include "geometry/retarget/retarget_onto.h"

#include <filesystem>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/gltf/gltf_onto.h"
#include "geometry/io/gltf/gltf_writer.h"
#include "geometry/rotation.h"
#include "tests/support/error_text.h"
#include "tests/support/glb_file.h"
#include "tests/support/moving_clip.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using testing::GlbFile;
using testing::TemporaryFolder;

const std::filesystem::path kMixamo = HOLDFAST_SOURCE_DIR "/tests/fixtures/gltf/mixamo.glb";

Eigen::Vector3d YUp(const Eigen::Vector3d& z_up) { return {z_up.x(), z_up.z(), -z_up.y()}; }

class OntoMixamo : public ::testing::Test {
 protected:
  OntoMixamo() {
    clip_ = Slice(ReadClip(HOLDFAST_MESHES_DIR "/clips/demo_inspect.npz"), 0, 60);
    clip_.object = testing::MakeMovingClip(60, 4).object;
  }

  SourceMotion Move() const { return RetargetOnto(clip_, body_, rig_.motion, map_); }
  // From joint to joint of SMPL-X, as the character has it.
  Eigen::Vector3d Bone(const SourceMotion& motion, int frame, int from, int to) const {
    return motion.positions[frame].col(map_.source[to]) -
           motion.positions[frame].col(map_.source[from]);
  }

  GltfAsset asset_ = GltfAsset::Read(kMixamo);
  GltfRig rig_ = ReadGltfRig(asset_);
  SkeletonMap map_ = RecognizeSkeleton(rig_.motion, "mixamo.glb");
  RetargetBody body_ = RetargetBodyOf(*BodyModel::Default());
  Clip clip_;
};

TEST_F(OntoMixamo, LimbsPointAsInTheClip) {
  const SourceMotion moved = Move();
  ASSERT_EQ(moved.NumFrames(), 60);
  EXPECT_EQ(moved.frame_rate, clip_.frame_rate);
  BodyState state;
  for (int t = 0; t < 60; t += 7) {
    ForwardJoints(body_.rest_joints, clip_.pose[t], clip_.trans.col(t), state);
    for (const auto& [from, to] :
         {std::pair{1, 4}, {4, 7}, {2, 5}, {5, 8}, {16, 18}, {18, 20}, {17, 19}, {19, 21}}) {
      const Eigen::Vector3d wanted = YUp(state.joints.col(to) - state.joints.col(from));
      EXPECT_LT((Bone(moved, t, from, to).normalized() - wanted.normalized()).norm(), 1e-6)
          << from << " " << t;
      // Bones keep the character's lengths.
      EXPECT_NEAR(Bone(moved, t, from, to).norm(), Bone(rig_.motion, 0, from, to).norm(), 1e-4);
    }
  }
}

// There and back, everything that both skeletons have is as it was.
TEST_F(OntoMixamo, ComesBackThroughRetarget) {
  RetargetOptions options;
  options.frame_rate = 0;
  options.find_ground = false;
  clip_.object.reset();
  const Clip back = Retarget(Move(), map_, body_, options);
  ASSERT_EQ(back.NumFrames(), 60);
  BodyState before, after;
  for (int t = 0; t < 60; t += 7) {
    ForwardJoints(body_.rest_joints, clip_.pose[t], clip_.trans.col(t), before);
    ForwardJoints(body_.rest_joints, back.pose[t], back.trans.col(t), after);
    for (const int joint : {0, 1, 2, 4, 5, 7, 8, 15, 16, 17, 18, 19, 20, 21}) {
      EXPECT_LT((before.joints.col(joint) - after.joints.col(joint)).norm(), 0.02)
          << kJointNames[joint] << " " << t;
    }
    for (const int joint : {0, 15, 20, 21}) {
      EXPECT_LT(AngleBetween(before.world_rotation[joint], after.world_rotation[joint]), 0.1)
          << kJointNames[joint] << " " << t;
    }
  }
}

TEST_F(OntoMixamo, HeldObjectStaysInTheHand) {
  clip_.holding_hand.assign(60, 0);
  for (int t = 10; t < 30; ++t) clip_.holding_hand[t] = kHoldsRight;
  const SourceMotion moved = Move();
  ASSERT_TRUE(moved.prop);
  BodyState state;
  for (int t = 10; t < 30; ++t) {
    ForwardJoints(body_.rest_joints, clip_.pose[t], clip_.trans.col(t), state);
    const Eigen::Vector3d from_wrist =
        moved.prop->positions.col(t) - moved.positions[t].col(map_.source[21]);
    EXPECT_LT((from_wrist - YUp(clip_.object->trans.col(t) - state.joints.col(21))).norm(), 1e-9);
  }
  // No jump when it is let go.
  const auto speed = [](const Eigen::Matrix3Xd& path, int t) {
    return (path.col(t + 1) - path.col(t)).norm();
  };
  EXPECT_NEAR(speed(moved.prop->positions, 29), speed(clip_.object->trans, 29), 1e-9);
}

// What a viewer shows are those joints, below a node in centimeters.
TEST_F(OntoMixamo, FileShowsTheJointsAndKeepsItsSkin) {
  const TemporaryFolder folder;
  const SourceMotion moved = Move();
  const TexturedMesh object = PlainMesh(testing::Tetrahedron(), ObjectMaterial());
  WriteGltfOnto(kMixamo, asset_, rig_, moved, map_.source[0], &object, "inspect", "test",
                folder / "a.glb");
  const GltfAsset written = GltfAsset::Read(folder / "a.glb");
  EXPECT_EQ(written.skins.size(), asset_.skins.size());
  EXPECT_EQ(written.meshes.size(), asset_.meshes.size() + 1);
  ASSERT_EQ(written.animations.size(), 1u);
  EXPECT_EQ(written.animations[0].name, "inspect");
  const SourceMotion read = ReadGltfRig(written).motion;
  ASSERT_EQ(read.NumFrames(), 60);
  for (int t = 0; t < 60; ++t) {
    EXPECT_LT((read.positions[t] - moved.positions[t]).colwise().norm().maxCoeff(), 1e-4) << t;
  }
  GltfMotionOptions options;
  options.prop = "thing";
  const SourceMotion with_object = ReadGltfMotion(folder / "a.glb", options);
  EXPECT_LT((with_object.prop->positions - moved.prop->positions).norm(), 1e-4);
}

// A character without any animation, in our own file: rotations are copied one by one.
TEST(RetargetOnto, SameSkeletonIsExact) {
  const TemporaryFolder folder;
  const BodySurface surface(BodyModel::Default());
  Clip rest = testing::MakeMovingClip(1, 2);
  rest.object.reset();
  WriteGlb(rest, surface, nullptr, {}, folder / "character.glb");
  const GltfAsset asset = GltfAsset::Read(folder / "character.glb");
  const GltfRig rig = ReadGltfRig(asset);
  const SkeletonMap map = RecognizeSkeleton(rig.motion, "character.glb");
  const Clip clip = testing::MakeMovingClip(12, 5);
  const SourceMotion moved =
      RetargetOnto(clip, RetargetBodyOf(*BodyModel::Default()), rig.motion, map);
  WriteGltfOnto(folder / "character.glb", asset, rig, moved, map.source[0], nullptr, "a", "b",
                folder / "a.glb");
  const GlbFile file(folder / "a.glb");
  BodyState state;
  for (const int t : {0, 5, 11}) {
    Forward(surface, clip.pose[t], clip.trans.col(t), state);
    const auto world = file.Pose(t);
    for (int j = 0; j < kNumJoints; ++j) {
      const Eigen::Vector3d shown = world[file.Node(std::string(kJointNames[j]))].translation();
      EXPECT_LT((shown - YUp(state.joints.col(j))).norm(), 1e-5) << kJointNames[j];
    }
  }
}

TEST(RetargetOnto, RefusesMirrorsAndChoices) {
  const auto fault = [](const char* file) {
    return testing::ErrorText([&] { ReadGltfRig(GltfAsset::Read(kMixamo.parent_path() / file)); });
  };
  EXPECT_THAT(fault("mirrored.gltf"), ::testing::HasSubstr("mirrors the character"));
  EXPECT_THAT(fault("two.glb"), ::testing::HasSubstr("Export one of them alone"));
}

TEST(RetargetOnto, TakesTheBonesThatVrmNames) {
  const std::filesystem::path vrm =
      HOLDFAST_SOURCE_DIR "/tests/fixtures/cases/vrm_humanoid/vrm0.glb";
  const GltfAsset asset = GltfAsset::Read(vrm);
  const GltfRig rig = ReadGltfRig(asset);
  const SkeletonMap map = RecognizeSkeleton(rig.motion, "vrm0.glb");
  EXPECT_EQ(map.NumMapped(), 22);
  const Clip clip = testing::MakeMovingClip(5, 5);
  const RetargetBody body = RetargetBodyOf(*BodyModel::Default());
  const SourceMotion moved = RetargetOnto(clip, body, rig.motion, map);
  BodyState state;
  ForwardJoints(body.rest_joints, clip.pose[3], clip.trans.col(3), state);
  for (int j = 0; j < kNumBodyJoints; ++j) {
    EXPECT_LT((moved.positions[3].col(map.source[j]) - YUp(state.joints.col(j))).norm(), 1e-3)
        << kJointNames[j];
  }
  const TemporaryFolder folder;
  WriteGltfOnto(vrm, asset, rig, moved, map.source[0], nullptr, "a", "b", folder / "a.glb");
  const SourceMotion read = ReadGltfMotion(folder / "a.glb");
  ASSERT_EQ(read.NumFrames(), 5);
  for (const auto& [bone, joint] : rig.motion.humanoid) {
    EXPECT_LT(
        (read.positions[3].col(read.humanoid.at(bone)) - moved.positions[3].col(joint)).norm(),
        1e-4)
        << bone;
  }
}

TEST(RetargetOnto, NeedsASkin) {
  const TemporaryFolder folder;
  WriteAtomically(folder / "bare.gltf", R"({"asset":{"version":"2.0"},"nodes":[{"name":"a"}]})");
  EXPECT_THROW(ReadGltfRig(GltfAsset::Read(folder / "bare.gltf")), Error);
}

}  // namespace
}  // namespace holdfast
