// SPDX-License-Identifier: MIT
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wrestrict"  // GCC 12 sees overlaps in operator+ that are not there
#endif
// Every command takes every clip: from a file as it was published to a result in one command.
#include <array>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/embedded.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "tests/support/data_folder.h"
#include "tests/support/program.h"
#include "tests/support/published_files.h"

namespace holdfast {
namespace {

using testing::DataFolder;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProgramFolder;
using testing::ProgramResult;
using testing::ReadText;
using testing::RunHoldfast;

using ClipInput = testing::ProgramTest;
using FromFileToFit = testing::ProgramTest;
using OtherBodies = testing::ProgramTest;
using ResultFolder = testing::ProgramTest;

constexpr int kFrames = 12;
constexpr const char* kModel = HOLDFAST_MESHES_DIR "/body/holdfast_neutral.npz";

Clip Demo() { return Slice(ReadClip(HOLDFAST_MESHES_DIR "/clips/demo_drink.npz"), 0, kFrames); }

// A mug that is held, in a folder "held" of its own.
Clip Held(const ProgramFolder& folder) {
  folder.Run("fit demo_drink mug -o held -q --no-report --end 12");
  return ReadClip(folder / "held/clip.npz");
}

// GRAB's folders: the sequence of a result beside the mesh that it names.
void WriteGrabOf(const ProgramFolder& folder, const std::string& result) {
  const TriangleMesh mug = ReadMesh(folder / (result + "/object.ply"));
  std::filesystem::create_directories(folder / "grab/s1");
  std::filesystem::create_directories(folder / "tools/object_meshes");
  WriteMesh(mug, folder / "tools/object_meshes/mug.ply");
  testing::WriteGrab(ReadClip(folder / (result + "/clip.npz")), "tools/object_meshes/mug.ply",
                     static_cast<std::size_t>(mug.NumVertices()),
                     folder / "grab/s1/mug_drink_1.npz");
}
void WriteGrabFolder(const ProgramFolder& folder) {
  Held(folder);
  WriteGrabOf(folder, "held");
}

// One command from the file to the mug in the hand.
void ExpectAMugHeld(const ProgramFolder& folder, const std::string& file) {
  const nlohmann::json fit = folder.Json("fit " + file + " mug -o out/fitted --no-report");
  EXPECT_GE(fit["summary"]["frames_in_contact_ratio"].get<double>(), 0.98);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/fitted/clip.npz"));
}

TEST_F(FromFileToFit, Grab) {
  WriteGrabFolder(folder);
  ExpectAMugHeld(folder, "grab/s1/mug_drink_1.npz");
}

TEST_F(FromFileToFit, AmassSmplx) {
  testing::WriteAmassSmplx(Demo(), folder / "walk_stageii.npz");
  ExpectAMugHeld(folder, "walk_stageii.npz");
}

TEST_F(FromFileToFit, AmassSmplh) {
  testing::WriteAmassSmplh(Demo(), folder / "walk_poses.npz");
  ExpectAMugHeld(folder, "walk_poses.npz");
}

TEST_F(FromFileToFit, Bvh) {
  folder.Run("export demo_drink -o drink.bvh --end 12");
  ExpectAMugHeld(folder, "drink.bvh");
}

TEST_F(FromFileToFit, GltfWithNamesOfMixamo) {
  ExpectAMugHeld(folder, "'" HOLDFAST_SOURCE_DIR "/tests/fixtures/gltf/mixamo.glb'");
}

TEST_F(FromFileToFit, Amc) {
  const std::filesystem::path motion = DataFolder() / "mocap/cmu_asfamc/01_01.amc.gz";
  if (!std::filesystem::exists(motion))
    GTEST_SKIP() << motion << " is not there: set HOLDFAST_DATA";
  ExpectAMugHeld(folder, std::string("'") + motion.string() + "' --end 12");
}

TEST_F(ClipInput, ResultFoldersAreClips) {
  Held(folder);
  EXPECT_EQ(folder.Json("fit held held/object.ply -o again --no-report")["grasp"]["made"], false);
  folder.Json(std::string("convert held --to-body '") + kModel + "' -o converted.npz");
  folder.Json("reach --goal 0,-1,1 --from held:3 --samples 1 --no-report -o reached");
}

TEST_F(ClipInput, FilesOfOthersAreImportedOnTheWay) {
  WriteGrabFolder(folder);
  folder.Run("export demo_drink -o walk.bvh --end 12");
  const std::string grab = "grab/s1/mug_drink_1.npz";
  for (const std::string command :
       {"render walk.bvh -o walk.png --size 64x64 --frame 2", "report walk.bvh -o walk.html",
        "export walk.bvh -o walk.glb", "score walk.bvh", "fit walk.bvh sphere -o w --no-report",
        "reach --goal 0,-1,1 --from walk.bvh:3 --samples 1 --no-report -o reached"}) {
    const ProgramResult run = folder.Run(command);
    EXPECT_THAT(run.err, HasSubstr("walk.bvh: BVH")) << command;
    EXPECT_THAT(run.err, HasSubstr("imported automatically")) << command;
  }
  for (const std::string& command :
       {"render " + grab + " -o grab.png --size 64x64 --frame 2", "score " + grab,
        "refine " + grab + " -o refined", "report " + grab + " -o grab.html"}) {
    const ProgramResult run = folder.Run(command);
    EXPECT_THAT(run.err, HasSubstr("GRAB sequence, imported automatically")) << command;
    EXPECT_THAT(run.err, HasSubstr("made with SMPL-X")) << command;
    EXPECT_THAT(run.err, Not(HasSubstr("only the body is drawn"))) << command;
  }
}

TEST_F(ClipInput, WhatIsNoClipIsNamedWithWhatWouldDo) {
  std::filesystem::create_directories(folder / "empty");
  std::ofstream(folder / "note.txt") << "no motion";
  for (const std::string clip : {"empty", "note.txt", "nowhere.npz"}) {
    folder.Fails("render " + clip + " -o a.png", 1, clip);
  }
  folder.Fails("fit nowhere.npz mug -o a", 1, "demo_drink");
}

TEST(Outputs, FoldersAboveAreMadeAndWhatExistsIsRefusedBeforeTheWork) {
  const ProgramFolder folder;
  Held(folder);
  const std::string mug = "'" HOLDFAST_MESHES_DIR "/objects/mug.ply'";
  int k = 0;
  const auto test = [&](const std::string& command, const std::string& extension) {
    const std::string output = std::string("new/") + std::to_string(++k) + "/deep/file" + extension;
    folder.Run(command + " -o " + output);
    EXPECT_TRUE(std::filesystem::exists(folder / output)) << command;
    folder.Fails(command + " -o " + output, 1, "exists already");
    // Where nothing can be made: refused as well, and nothing left.
    folder.Fails(command + " -o held/clip.npz/file" + extension, 1, "held/clip.npz");
  };
  test("render held --frame 1 --size 64x64", ".png");
  test("report held", ".html");
  test("export held", ".glb");
  test("export held", ".npz");
  test("score held", ".json");
  test("decimate " + mug, ".ply");
  test("grasp sphere", ".npz");
  test("import held/clip.npz", ".npz");
  test("fit held held/object.ply --no-report", "");
  test("refine held", "");
  test(std::string("convert held --to-body '") + kModel + "'", ".npz");
}

// Where joints 0..21 are in a frame of a clip's file, by SMPL-X's equations and arrays alone:
// G_0 = [R_0 | J_0], G_j = G_parent [R_j | J_j - J_parent], all moved by trans. J_0 is SMPL-X's;
// the other joints are as far from it as they are in `body`.
Eigen::Matrix<double, 3, 22> JointsBySmplx(const NpzReader& clip, const NpzReader& body,
                                           std::size_t frame) {
  constexpr std::array<int, 22> kParents = {-1, 0, 0, 0, 1,  2,  3,  4,  5,  6,  7,
                                            8,  9, 9, 9, 12, 13, 14, 16, 17, 18, 19};
  const auto numbers = [](const NpzReader& file, const char* key) {
    return file.Read(key).AsDoubles();
  };
  const std::vector<double> vertices = numbers(body, "v_template"),
                            regressor = numbers(body, "J_regressor"),
                            trans = numbers(clip, "trans"), root = numbers(clip, "root_orient"),
                            pose = numbers(clip, "pose_body");
  const std::size_t count = vertices.size() / 3;
  Eigen::Matrix<double, 3, 22> rest = Eigen::Matrix<double, 3, 22>::Zero(), joints;
  for (std::size_t k = 0; k < 22 * count; ++k) {
    const auto joint = static_cast<Eigen::Index>(k / count);
    rest.col(joint) += regressor[k] * Eigen::Vector3d(&vertices[3 * (k % count)]);
  }
  std::array<Eigen::Matrix3d, 22> turned;
  for (int j = 0; j < 22; ++j) {
    const Eigen::Vector3d w(j == 0 ? &root[3 * frame]
                                   : &pose[63 * frame + 3 * static_cast<std::size_t>(j - 1)]);
    const double angle = w.norm();
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, angle > 0.0 ? Eigen::Vector3d(w / angle)
                                                                      : Eigen::Vector3d::UnitX())
                                     .toRotationMatrix();
    const int parent = kParents[j];
    if (parent < 0) {
      joints.col(0) = testing::SmplxPelvis() + Eigen::Vector3d(&trans[3 * frame]);
      turned[0] = turn;
      continue;
    }
    const Eigen::Matrix3d& before = turned[parent];
    joints.col(j) = joints.col(parent) + before * (rest.col(j) - rest.col(parent));
    turned[j] = before * turn;
  }
  return joints;
}

TEST_F(OtherBodies, CodeForSmplxPutsTheBodyAtTheObject) {
  const Clip clip = Held(folder);
  const NpzReader file(folder / "held/clip.npz"), body(std::filesystem::path{kModel});
  const BodySurface surface(BodyModel::Default(), clip.betas);
  BodyState state;
  for (const int t : {0, 5, kFrames - 1}) {
    const auto joints = JointsBySmplx(file, body, static_cast<std::size_t>(t));
    ForwardJoints(surface.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    EXPECT_LT((joints - state.joints.leftCols<22>()).cwiseAbs().maxCoeff(), 1e-6) << t;
    // The mug is in the hand.
    EXPECT_LT((joints.col(21) - clip.object->trans.col(t)).norm(), 0.2) << t;
  }
}

// Joint 0 is at J_0 + trans, and J_0 is SMPL-X's in the embedded body as well.
TEST_F(OtherBodies, TransGoesWithThePelvis) {
  WriteGrabFolder(folder);
  const double held =
      folder.Json("score held")["clips"][0]["values"]["contact_ratio"].get<double>();
  for (const std::string clip : {"grab/s1/mug_drink_1.npz", "imported.npz"}) {
    if (clip == "imported.npz") {
      const ProgramResult import = folder.Run("import grab/s1/mug_drink_1.npz -o imported.npz");
      EXPECT_THAT(import.err, HasSubstr("made with SMPL-X"));
      EXPECT_THAT(import.err, Not(HasSubstr("trans is moved")));
      EXPECT_THAT(import.err, Not(HasSubstr("mm from it")));
    }
    const nlohmann::json score = folder.Json("score " + clip);
    EXPECT_NEAR(score["clips"][0]["values"]["contact_ratio"].get<double>(), held, 0.002) << clip;
    EXPECT_EQ(score["clips"][0]["foreign_body"], true);
  }
  // On the file's own kind of body nothing moves.
  const Clip imported = ReadClip(folder / "imported.npz");
  EXPECT_EQ(imported.body_model, "");
  EXPECT_LT((imported.trans -
             testing::TransFor(ReadClip(folder / "held/clip.npz"), testing::SmplxPelvis()))
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
  EXPECT_LT((imported.trans - ReadClip(folder / "held/clip.npz").trans).cwiseAbs().maxCoeff(),
            1e-6);
  // A result is of the body that it was made on: it is not moved again.
  const nlohmann::json fit = folder.Json("fit imported.npz mug -o fitted --no-report");
  EXPECT_EQ(ReadClip(folder / "fitted/clip.npz").body_model, "holdfast_neutral");
  EXPECT_EQ(folder.Json("score fitted")["clips"][0]["foreign_body"], false);
}

// The mesh of a sequence that came without the data set's folders.
TEST_F(ClipInput, AMeshThatStandsInIsToldOf) {
  WriteGrabFolder(folder);
  EXPECT_THAT(folder.Run("score grab/s1/mug_drink_1.npz").err, Not(HasSubstr("Holdfast's own")));
  std::filesystem::remove_all(folder / "tools");
  folder.Run("import grab/s1/mug_drink_1.npz -o imported.npz");
  for (const std::string clip : {"grab/s1/mug_drink_1.npz", "imported.npz"}) {
    const ProgramResult score = folder.Run("score " + clip);
    EXPECT_THAT(score.err,
                HasSubstr("warning: " + clip + ": the mesh of its object was not found"));
    EXPECT_THAT(folder.Run("score " + clip + " --object mug").err,
                Not(HasSubstr("Holdfast's own")));
  }
  // A clip that says so means the embedded object.
  Clip clip = ReadClip(folder / "held/clip.npz");
  clip.object->mesh = "mug";
  WriteClip(clip, folder / "own.npz");
  EXPECT_THAT(folder.Run("score own.npz").err, Not(HasSubstr("Holdfast's own")));
}

// GRAB's folders of a person whose surface lies beside the sequence: in the embedded body's
// vertices, which is what a test can make of it.
void WriteGrabOfAnother(const ProgramFolder& folder) {
  folder.Run("transfer held --betas=3,1 -o other -q --no-report");
  const auto body = BodyModel::Default();
  TriangleMesh surface;
  surface.vertices = body->ShapedVertices(ReadClip(folder / "other/clip.npz").betas);
  surface.faces = body->Faces();
  std::filesystem::create_directories(folder / "tools/subject_meshes/male");
  WriteMesh(surface, folder / "tools/subject_meshes/male/s1.ply");
  WriteGrabOf(folder, "other");
}

// What a command says of contact and depth is what `score` finds in the clip that it wrote.
void ExpectScoredAlike(const ProgramFolder& folder, const std::string& output,
                       const nlohmann::json& said) {
  const nlohmann::json values = folder.Json("score " + output)["clips"][0]["values"];
  EXPECT_NEAR(values["penetration_max_mm"].get<double>(),
              said["max_penetration_depth_mm"].get<double>(), 0.01)
      << output;
  EXPECT_NEAR(values["contact_frames_ratio"].get<double>(),
              said["frames_in_contact_ratio"].get<double>(), 1e-6)
      << output;
}

TEST_F(OtherBodies, ContactIsMeasuredOnTheBodyThatIsShown) {
  for (const bool with_surface : {false, true}) {
    if (with_surface) {
      WriteGrabOfAnother(folder);
    } else {
      WriteGrabFolder(folder);
    }
    const std::string grab = "grab/s1/mug_drink_1.npz", more = with_surface ? "_1" : "_0";
    for (const bool keep : {false, true}) {
      const std::string output = (keep ? "kept" : "fitted") + more;
      const nlohmann::json fit = folder.Json("fit " + grab + " mug --no-report -o " + output +
                                             (keep ? " --keep-grasp" : ""));
      // The hand of the body that is shown is not the capture's: as the documentation has it.
      EXPECT_EQ(fit["grasp"]["made"], !keep);
      ExpectScoredAlike(folder, output, fit["summary"]);
    }
    const nlohmann::json refined = folder.Json("refine " + grab + " -o refined" + more);
    ExpectScoredAlike(folder, "refined" + more, refined["after"]);
  }
}

TEST_F(OtherBodies, WhyAGraspIsNotKeptIsSaid) {
  WriteGrabFolder(folder);
  const std::string grab = "fit grab/s1/mug_drink_1.npz ", more = " --no-report -o ";
  ProgramResult fit = folder.Run(grab + "mug" + more + "a");
  EXPECT_THAT(fit.err, HasSubstr("the clip's grasp is of a hand of SMPL-X"));
  EXPECT_THAT(fit.err, HasSubstr("making a new grasp (--keep-grasp keeps the clip's)"));
  // Its own mesh is another one of the same name.
  TriangleMesh larger = ReadMesh(folder / "tools/object_meshes/mug.ply");
  larger.vertices *= 1.2;
  WriteMesh(larger, folder / "tools/object_meshes/mug.ply");
  fit = folder.Run(grab + "mug" + more + "b");
  EXPECT_THAT(fit.err,
              HasSubstr("the clip's grasp is of another mesh named mug: making a new grasp"));
  EXPECT_THAT(fit.err, Not(HasSubstr("of mug, not of mug")));
}

TEST_F(OtherBodies, AHandThatIsAwayFromWhatItHoldsIsSaid) {
  Clip clip = Held(folder);
  clip.object->trans.row(2).array() += 0.15;  // as longer arms would
  clip.holding_hand.assign(kFrames, kHoldsRight);
  std::filesystem::copy(folder / "held/object.ply", folder / "object.ply");
  WriteClip(clip, folder / "away.npz");
  for (const std::string command :
       {"score away.npz", "refine away.npz -o r", "fit away.npz object.ply -o f --no-report",
        "import away.npz -o again.npz"}) {
    const ProgramResult run = RunHoldfast(folder.Path(), command);
    EXPECT_THAT(run.err, HasSubstr("says that a hand holds the object in 12 of 12 frames"))
        << command;
    EXPECT_THAT(run.err, HasSubstr("mm from it")) << command;
    EXPECT_THAT(run.err, HasSubstr("--regrasp")) << command;
  }
  const ProgramResult doctor = RunHoldfast(folder.Path(), "doctor away.npz");
  EXPECT_THAT(doctor.out, HasSubstr("mm from it"));
  EXPECT_THAT(doctor.out, HasSubstr("--regrasp"));
}

// Runs every command that reads the folder "held"; each must end with exit code 1 and name the
// mesh.
void ExpectTheMeshIsMissed(const ProgramFolder& folder, const std::string& why) {
  for (const std::string command :
       {"score held", "report held -o page.html", "render held -o held.png --size 64x64",
        "refine held -o refined", "transfer held --scale 1.1 -o scaled", "export held -o held.glb",
        "export held -o contacts.npz", "doctor held"}) {
    const ProgramResult run = folder.Run(command, 1);
    const std::string said = run.out + run.err;
    EXPECT_THAT(said, HasSubstr("held/object.ply")) << command;
    EXPECT_THAT(said, HasSubstr(why)) << command;
    EXPECT_THAT(said, HasSubstr("--object")) << command;
  }
}

TEST_F(ResultFolder, NoOtherMeshStandsInForItsOwn) {
  folder.Run("fit demo_drink mug -o held -q --no-report --end 12 --object-scale 0.9");
  const std::filesystem::path mesh = folder / "held/object.ply";
  const std::string bytes = ReadText(mesh);
  const auto put = [&](const std::string& content) {
    std::ofstream(mesh, std::ios::binary) << content;
  };
  folder.Run("score held");
  // Cut, another of its size, missing.
  put(bytes.substr(0, bytes.size() / 2));
  ExpectTheMeshIsMissed(folder, "may be cut short");
  put(bytes);
  TriangleMesh other = ReadMesh(mesh);
  other.vertices(0, 7) += 1e-4;
  WriteMesh(other, mesh);
  ExpectTheMeshIsMissed(folder, "is not the mesh that held/clip.npz was made with");
  std::filesystem::remove(mesh);
  ExpectTheMeshIsMissed(folder, "is missing");
  // The user may say which mesh it is; a fit takes the motion alone.
  folder.Run("score held --object mug --object-scale 0.9");
  folder.Run("fit held apple -o apple --end 3 --no-report");
  // A clip without checksum takes the file as it is, and misses one that is not there.
  WriteClip(ReadClip(folder / "held/clip.npz"), folder / "held/clip.npz");
  WriteMesh(other, mesh);
  folder.Run("score held");
  std::filesystem::remove(mesh);
  folder.Run("score held", 1);
}

TEST_F(ResultFolder, ItsClipExportedElsewhereKeepsItsMesh) {
  Held(folder);
  std::filesystem::create_directories(folder / "out");
  for (const std::string command :
       {"export held -o out/exported.npz", "import held/clip.npz -o out/imported.npz"}) {
    folder.Run(command);
  }
  folder.Run("score out/exported.npz out/imported.npz");
}

// The lines of AMASS's notebook and of the loaders after it.
void ExpectAmassLoads(const std::filesystem::path& path, int frames) {
  const NpzReader file(path);
  const Clip clip = ReadClip(path);
  const NpyMember poses = file.Read("poses");
  poses.RequireShape({frames, 165});
  const std::vector<double> values = poses.AsDoubles();
  for (int t = 0; t < frames; ++t) {
    for (int k = 0; k < 165; ++k) {
      ASSERT_NEAR(values[165 * t + k], clip.pose[t].reshaped()(k), 1e-6);
    }
  }
  const std::vector<std::int64_t> num_betas = file.Read("num_betas").AsIntegers();
  ASSERT_EQ(num_betas.size(), 1U);
  EXPECT_GT(num_betas[0], 0);
  EXPECT_EQ(file.Read("betas").array.NumElements(), static_cast<std::size_t>(num_betas[0]));
  EXPECT_NEAR(file.Read("mocap_time_length").AsDoubles()[0],
              frames / file.Read("mocap_frame_rate").AsDoubles()[0], 1e-12);
  EXPECT_EQ(file.Read("gender").AsText(), clip.gender);
}

TEST(AmassLayout, IsWhatEveryCommandWrites) {
  const ProgramFolder folder;
  Held(folder);
  ExpectAmassLoads(folder / "held/clip.npz", kFrames);
  folder.Json("export held -o exported.npz --start 2");
  ExpectAmassLoads(folder / "exported.npz", kFrames - 2);
  folder.Json(std::string("convert held --to-body '") + kModel + "' -o converted.npz --betas 0");
  ExpectAmassLoads(folder / "converted.npz", kFrames);
  folder.Json("import held/clip.npz -o imported.npz");
  ExpectAmassLoads(folder / "imported.npz", kFrames);
  // Twice the pose, yet not twice the file.
  NpzWriter alone;
  const NpzReader file(folder / "held/clip.npz");
  for (const std::string& key : file.Keys()) {
    if (key != "poses") alone.Add(key, file.Read(key).array);
  }
  alone.Write(folder / "alone.npz");
  EXPECT_LT(static_cast<double>(std::filesystem::file_size(folder / "held/clip.npz")),
            1.6 * static_cast<double>(std::filesystem::file_size(folder / "alone.npz")));
}

}  // namespace
}  // namespace holdfast
