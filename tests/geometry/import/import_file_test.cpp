// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>

#include "geometry/error.h"
#include "geometry/import/data_set_files.h"
#include "geometry/import/load_clip.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/io/pickle/data_file.h"
#include "geometry/object/load_object.h"
#include "tests/support/imported.h"
#include "tests/support/temporary_folder.h"

namespace holdfast::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Parameters of `frames` frames, one array of which is another.
std::filesystem::path WriteParameters(const TemporaryFolder& folder, const std::string& name,
                                      std::size_t frames,
                                      const std::function<void(NpzWriter&)>& change) {
  NpzWriter writer;
  for (const auto& [key, n] : {std::pair{"global_orient", 3U},
                               {"body_pose", 63U},
                               {"transl", 3U},
                               {"left_hand_pose", 45U},
                               {"right_hand_pose", 45U}}) {
    writer.AddFloat64(key, {frames, n}, std::vector<double>(frames * n, 0.1));
  }
  change(writer);
  writer.Write(folder / name);
  return folder / name;
}

TEST(ImportFile, TellsFormatsByContentNotByName) {
  const TemporaryFolder folder;
  const std::pair<const char*, const char*> files[] = {
      {"parameters/grab/grab/s1/mug_drink_1.npz", "GRAB sequence"},
      {"torch/s10_mug_drink_1.npz", "IMoS result"},
      {"parameters/amass_poses_only.npz", "AMASS, SMPL-X"},
      {"parameters/amass_smplh_poses.npz", "AMASS, SMPL-H"},
      {"parameters/motion_x.npy", "Motion-X"},
      {"parameters/smplx.json", "SMPL-X parameters"},
      {"parameters/pixie_param.pkl", "SMPL-X parameters"},
  };
  int i = 0;
  for (const auto& [fixture, format] : files) {
    const std::filesystem::path renamed = folder / ("download(" + std::to_string(i++) + ").bin");
    std::filesystem::copy(Fixture(fixture), renamed);
    EXPECT_EQ(Import(renamed).format, format) << fixture;
  }
}

TEST(ImportFile, AClipComesBackAsItIs) {
  const TemporaryFolder folder;
  const Clip grab = Import(Fixture("parameters/grab/grab/s1/mug_drink_1.npz")).clip;
  WriteClip(grab, folder / "clip.npz");
  const ImportedFile again = Import(folder / "clip.npz");
  EXPECT_EQ(again.format, "clip");
  EXPECT_EQ(Joints(again.clip, 0, kNumJoints), Joints(grab, 0, kNumJoints));
  EXPECT_EQ(again.clip.object->orient, grab.object->orient);
}

TEST(ImportFile, SaysWhatAFileIsThatHoldsNoMotion) {
  const TemporaryFolder folder;
  EXPECT_THAT(ImportFault(folder / "none.npz"), HasSubstr("does not exist"));
  EXPECT_THAT(ImportFault(Fixture("parameters/SMPLX_TEST.npz")), HasSubstr("hands_componentsl"));
  EXPECT_THAT(ImportFault(Fixture("torch/network.pt")), HasSubstr("without a known motion"));
  NpzWriter model;
  model.AddFloat64("v_template", {2, 3}, std::vector<double>(6));
  model.AddFloat64("weights", {2, 55}, std::vector<double>(110));
  model.Write(folder / "model.npz");
  EXPECT_THAT(ImportFault(folder / "model.npz"), HasSubstr("--body"));
  std::filesystem::create_directory(folder / "empty");
  EXPECT_THAT(ImportFault(folder / "empty"), HasSubstr("without parameter files"));
  std::ofstream(folder / "text.txt") << "once upon a time\n";
  EXPECT_NE(ImportFault(folder / "text.txt"), "no error");
}

TEST(ImportFile, NamesTheFieldAndTheFrameOfWhatIsWrong) {
  const TemporaryFolder folder;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto fault = [&](const char* key, std::vector<std::size_t> shape,
                         const std::vector<double>& values) {
    return ImportFault(WriteParameters(folder, "p.npz", 5,
                                       [&](NpzWriter& w) { w.AddFloat64(key, shape, values); }));
  };
  std::vector<double> body(5 * 63, 0.1);
  EXPECT_EQ(fault("body_pose", {5, 63}, body), "no error");
  body[3 * 63 + 7] = nan;
  EXPECT_THAT(fault("body_pose", {5, 63}, body),
              AllOf(HasSubstr("body_pose"), HasSubstr("frame 3")));
  const auto zeros = [&](const char* key, std::size_t frames, std::size_t columns) {
    return fault(key, {frames, columns}, std::vector<double>(frames * columns));
  };
  EXPECT_THAT(zeros("transl", 4, 3), HasSubstr("4 frames"));
  EXPECT_THAT(zeros("right_hand_pose", 3, 45), HasSubstr("right_hand_pose"));
  EXPECT_THAT(zeros("body_pose", 5, 84), HasSubstr("quaternions"));
  EXPECT_THAT(zeros("body_pose", 5, 126), HasSubstr("6D"));
  EXPECT_THAT(zeros("body_pose", 0, 63), HasSubstr("body_pose"));
  EXPECT_THAT(fault("fps", {}, {0}), HasSubstr("fps"));
}

TEST(ImportFile, WhatDoesNotMoveMayBeThereOnce) {
  const TemporaryFolder folder;
  const auto with_jaw = [](NpzWriter& w) { w.AddFloat64("jaw_pose", {1, 3}, {0.2, 0, 0}); };
  const Clip clip = Import(WriteParameters(folder, "p.npz", 5, with_jaw)).clip;
  for (int t = 0; t < 5; ++t) EXPECT_EQ(clip.pose[t](0, 22), 0.2);
}

TEST(ImportFile, AShortBodyClaimsNoMemoryForALongRoot) {
  const TemporaryFolder folder;
  NpzWriter writer;
  writer.AddFloat32("global_orient", {1'500'000, 3}, std::vector<float>(4'500'000));
  writer.AddFloat32("body_pose", {1, 63}, std::vector<float>(63));
  writer.Write(folder / "long.npz");
  EXPECT_THAT(ImportFault(folder / "long.npz"),
              HasSubstr("too few numbers for the 1500000 frames"));
}

TEST(ImportFile, ThreeFramesOfOneJointAreNotAMatrix) {
  const TemporaryFolder folder;
  NpzWriter writer;
  const Eigen::Matrix3d R = ExpSO3({0.4, -1, 0.3});
  std::vector<double> rows;
  for (int i = 0; i < 9; ++i) rows.push_back(R(i / 3, i % 3));
  writer.AddFloat64("angles", {3, 3}, {1, 0, 0, 1, 0.1, 0, 1, 0.2, 0});
  writer.AddFloat64("angles3", {3, 1, 3}, {1, 0, 0, 1, 0.1, 0, 1, 0.2, 0});
  writer.AddFloat64("matrix", {3, 3}, rows);
  writer.AddFloat64("matrix4", {1, 1, 3, 3}, rows);
  writer.AddFloat64("flat", {1, 9}, rows);
  writer.Write(folder / "a.npz");
  const DataFile file(folder / "a.npz");
  ImportedClip imported;
  for (const char* name : {"angles", "angles3"}) {
    EXPECT_EQ(ReadObjectRotations(file[name], imported).cols(), 3) << name;
  }
  EXPECT_EQ(imported.object_defects.matrices, 0);
  for (const char* name : {"matrix", "matrix4", "flat"}) {
    const Eigen::MatrixXd w = ReadObjectRotations(file[name], imported);
    ASSERT_EQ(w.cols(), 1) << name;
    EXPECT_LT((ExpSO3(w.col(0)) - R).cwiseAbs().maxCoeff(), 1e-12) << name;
  }
  EXPECT_EQ(imported.object_defects.matrices, 3);
}

TEST(ImportFile, ReadsWhatThisMachinesNumpyWrites) {
  const std::string python = "/usr/bin/python3 -c 'import numpy, scipy' 2>/dev/null";
  if (std::system(python.c_str()) != 0) GTEST_SKIP() << "/usr/bin/python3 has no numpy or no scipy";
  const TemporaryFolder folder;
  const std::string script = Fixture("make_parameters.py").string();
  const std::string command = "/usr/bin/python3 '" + script + "' '" + folder.Path().string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  for (const char* name : {"grab/grab/s1/mug_drink_1.npz", "amass_smplx_stageii.npz",
                           "list_of_frames.pkl", "pixie_param.pkl", "rotation_matrices.npz"}) {
    const Clip made = Import(folder / name).clip;
    const Clip kept = Import(Fixture(std::string("parameters/") + name)).clip;
    ASSERT_EQ(made.NumFrames(), kept.NumFrames()) << name;
    EXPECT_LT(LargestTurn(Joints(made, 0, kNumJoints), Joints(kept, 0, kNumJoints)), 1e-5) << name;
    EXPECT_LT((made.trans - kept.trans).cwiseAbs().maxCoeff(), 1e-6) << name;
  }
}

TEST(FrameFiles, AreInTheOrderPeopleNumberThem) {
  std::vector<std::string> names = {"frame_10", "frame_9", "frame_09b",
                                    "frame_1",  "a",       "frame_100"};
  std::ranges::sort(names, NaturalLess);
  EXPECT_THAT(names, ::testing::ElementsAre("a", "frame_1", "frame_9", "frame_09b", "frame_10",
                                            "frame_100"));
  EXPECT_FALSE(NaturalLess("7", "7"));
  EXPECT_NE(NaturalLess("07", "7"), NaturalLess("7", "07"));
}

TEST(FrameFiles, OtherFilesInTheFolderAreNoFrames) {
  const TemporaryFolder folder;
  for (const char* name :
       {"0001.pkl", "0002.pkl", "0004.pkl", "readme.txt", "meta.json", ".x.pkl"}) {
    std::ofstream(folder / name) << "x";
  }
  std::vector<std::string> notes;
  EXPECT_EQ(FindFrameFiles(folder.Path(), 0, notes).size(), 3U);
  EXPECT_THAT(notes,
              ::testing::ElementsAre(HasSubstr("between the first and the last number: 1;")));
}

// Which mesh the object of a clip is, by what the clip, its file and its importer tell.
TEST(FindClipObject, TakesTheClipsOwnThenTheOneItNamesThenTheNames) {
  LoadedClip loaded;
  EXPECT_FALSE(FindClipObject(loaded).mesh);
  ObjectTrack& track = loaded.clip.object.emplace();
  EXPECT_THAT(FindClipObject(loaded).missing, HasSubstr("does not name the mesh"));

  track.name = "mug";
  const ClipObject named = FindClipObject(loaded, 2.0);
  ASSERT_TRUE(named.mesh);
  EXPECT_TRUE(named.by_name && !named.in_clip && named.missing.empty());
  EXPECT_TRUE(named.mesh->vertices.isApprox(2.0 * LoadObject("mug").mesh.vertices));

  const TemporaryFolder folder;
  WriteMesh(LoadObject("apple").mesh, folder / "object.ply");
  loaded.file = folder / "clip.npz";
  track.mesh = "object.ply";
  const ClipObject beside = FindClipObject(loaded);
  EXPECT_EQ(beside.source, (folder / "object.ply").string());
  EXPECT_FALSE(beside.by_name || beside.in_clip);

  loaded.object_mesh = folder / "object.ply";
  loaded.object_mesh_scale = 0.5;
  const ClipObject imported = FindClipObject(loaded, 3.0);
  EXPECT_EQ(imported.scale, 1.5);
  EXPECT_TRUE(imported.mesh->vertices.isApprox(1.5 * beside.mesh->vertices));

  loaded.object_surface = LoadObject("bottle").mesh;
  EXPECT_TRUE(FindClipObject(loaded).in_clip);
  EXPECT_EQ(FindClipObject(loaded).mesh->NumFaces(), loaded.object_surface->NumFaces());
  track.surface = std::make_shared<const TriangleMesh>(LoadObject("mug").mesh);
  EXPECT_EQ(FindClipObject(loaded).mesh->NumFaces(), track.surface->NumFaces());

  // A file that the clip's own file names is that or none.
  loaded.object_mesh.clear();
  loaded.object_surface.reset();
  track.surface.reset();
  std::filesystem::remove(folder / "object.ply");
  EXPECT_FALSE(FindClipObject(loaded).mesh);
  EXPECT_THAT(FindClipObject(loaded).missing, HasSubstr("object.ply"));
  std::ofstream(folder / "metrics.json") << "{}";  // a result
  EXPECT_THROW(FindClipObject(loaded), Error);
  track.mesh = "mug";  // embedded
  EXPECT_FALSE(FindClipObject(loaded).by_name);

  loaded = {};
  loaded.clip.object.emplace().mesh = "nothing.ply";
  EXPECT_THAT(FindClipObject(loaded).missing, HasSubstr("nothing.ply"));
}

// The embedded object of a name is what Holdfast's clips mean by it, and nobody else's.
TEST(FindClipObject, WarnsWhereAnEmbeddedMeshStandsInForAnothers) {
  LoadedClip loaded;
  ObjectTrack& track = loaded.clip.object.emplace();
  track.name = "mug";
  EXPECT_THAT(FindClipObject(loaded).warning, HasSubstr("Holdfast's own 'mug' is used"));
  loaded.clip.body_model = BodyModel::kDefaultName;
  EXPECT_EQ(FindClipObject(loaded).warning, "");
  loaded.change = BodyChange{"SMPL-X", Eigen::Vector3d::Zero()};  // brought onto that body
  EXPECT_THAT(FindClipObject(loaded).warning, HasSubstr("is used instead"));
  track.mesh = "mug";  // embedded, by a clip that says so
  EXPECT_EQ(FindClipObject(loaded).warning, "");
  track.mesh.clear();
  track.name = "none such";
  EXPECT_EQ(FindClipObject(loaded).warning, "");
}

}  // namespace
}  // namespace holdfast::testing
