// SPDX-License-Identifier: MIT
#include "geometry/export/export_clip.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/import/load_clip.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::ElementsAre;

TEST(ExportClip, KnowsFormatsByName) {
  EXPECT_EQ(ExportFormatOf("a/held.GLB"), ExportFormat::kGlb);
  EXPECT_EQ(ExportFormatOf("x_contacts.npz"), ExportFormat::kContacts);
  EXPECT_EQ(ExportFormatOf("contact.npz"), ExportFormat::kClip);
  EXPECT_EQ(ExportFormatOf("m_%03d.obj"), ExportFormat::kMeshes);
  for (const char* name : {"a.fbx", "a", "a.ply", "a_%s.ply", "a_%d_%d.obj", "a_%03d.glb"}) {
    EXPECT_THROW(ExportFormatOf(name), Error) << name;
  }
}

TEST(ExportClip, WritesTheFilesItNames) {
  const LoadedClip loaded = LoadClip("demo_drink");
  ClipScene scene;
  scene.clip = Slice(loaded.clip, 0, 5);
  scene.body = loaded.body.model;
  scene.betas = loaded.body.betas;
  ExportOptions options;
  options.every = 2;
  options.first_frame = 7;
  options.threads = 2;
  const testing::TemporaryFolder folder;
  const std::filesystem::path name = folder / "m_%d.ply";
  EXPECT_THAT(ExportedFiles(scene, options, name),
              ElementsAre(folder / "m_7.ply", folder / "m_9.ply", folder / "m_11.ply"));
  int calls = 0;
  const ExportReport report = ExportClip(scene, options, name, [&](const char*, int, int total) {
    EXPECT_EQ(total, 3);
    ++calls;
    return true;
  });
  EXPECT_EQ(calls, 3);
  EXPECT_FALSE(report.has_object || report.stopped);
  BodyState state;
  Forward(scene.Surface(), scene.clip.pose[4], scene.clip.trans.col(4), state);
  EXPECT_TRUE(ReadMesh(report.files[2]).vertices.isApprox(state.vertices, 1e-5));
  EXPECT_TRUE(
      ExportClip(scene, options, name, [](const char*, int, int) { return false; }).stopped);
}

TEST(ExportClip, RefusesOptionsOfOtherFormats) {
  const LoadedClip loaded = LoadClip("demo_drink");
  ClipScene scene;
  scene.clip = Slice(loaded.clip, 0, 2);
  scene.body = loaded.body.model;
  const testing::TemporaryFolder folder;
  ExportOptions options;
  options.every = 2;
  EXPECT_THROW(ExportClip(scene, options, folder / "a.bvh"), Error);
  options.every = 1;
  EXPECT_THROW(ExportClip(scene, options, folder / "contacts.csv"), Error);
  options.onto = "character.glb";
  EXPECT_THROW(ExportClip(scene, options, folder / "a.bvh"), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder.Path()));
}

}  // namespace
}  // namespace holdfast
