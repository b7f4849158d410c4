// SPDX-License-Identifier: MIT
// What a file is told to be, by its content; and that no content brings the inspection down.
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/inspect/inspection.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/mesh.h"
#include "geometry/object/load_object.h"
#include "tests/support/data_folder.h"
#include "tests/support/error_text.h"
#include "tests/support/synthetic_body.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

void WriteBytes(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string EmbeddedBytes(const char* name) {
  const EmbeddedFile file = FindEmbedded(name);
  return {reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()};
}

std::string All(const Inspection& inspection) {
  std::string text = inspection.title + "\n";
  for (const Fact& fact : inspection.facts) text += fact.text + "\n";
  for (const Finding& finding : inspection.findings)
    text += finding.text + " -> " + finding.fix + "\n";
  return text;
}

TEST(Identify, GoesByContentAndNotByName) {
  using std::string_literals::operator""s;
  const TemporaryFolder folder;
  const std::pair<std::string, FileKind> cases[] = {
      {"HIERARCHY\nROOT Hips\n{\n", FileKind::kBvh},
      {"# a comment\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 0 0 0 0 0 0\n", FileKind::kAmc},
      {":version 1.10\n:name VICON\n", FileKind::kAsf},
      {"# cube\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", FileKind::kObj},
      {"ply\nformat ascii 1.0\nelement vertex 3\nelement face 1\nend_header\n", FileKind::kPly},
      {"ply\nformat ascii 1.0\nelement vertex 3\nend_header\n", FileKind::kPlyPoints},
      {"solid x\n facet normal 0 0 1\n", FileKind::kStl},
      {std::string(80, ' ') + "\x01\0\0\0"s + std::string(50, '\0'), FileKind::kStl},
      {"OFF\n3 1 0\n", FileKind::kOff},
      {"glTF\x02\0\0\0"s, FileKind::kGlb},
      {"{\"asset\": {\"version\": \"2.0\"}, \"nodes\": []}", FileKind::kGltf},
      {"\x80\x04\x95\x10\0\0\0\0\0\0\0}\x94."s, FileKind::kPickle},
      {"(dp0\nS'v_template'\np1\n.", FileKind::kPickle},
      {"\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.\x80\x02M\xe9\x03."s,
       FileKind::kTorch},
      {"\x02\0\0\0\0\0\0\0{}  "s, FileKind::kSafetensors},
      {"\x93NUMPY\x01\0"s, FileKind::kNpy},
      {"{\"schema\": \"holdfast/fit/1\"}", FileKind::kMetrics},
      {"{\"Hips\": \"pelvis\", \"Head\": \"head\"}", FileKind::kSkeletonMap},
      {"[1, 2]", FileKind::kJson},
      {"<!DOCTYPE html><html><body>Please log in</body></html>", FileKind::kHtml},
      {"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 5\n",
       FileKind::kGitLfsPointer},
      {"\x89HDF\r\n\x1a\n"s, FileKind::kHdf5},
      {"\x89PNG\r\n\x1a\n"s, FileKind::kPicture},
      {"Just a few words.\n", FileKind::kText},
      {"\x01\x02\x03\x04\x05\xff\xfe\x00\x01"s, FileKind::kUnknown},
      {"", FileKind::kEmpty},
      {"PK\x03\x04 and no more", FileKind::kDamagedArchive},
      {"\x1f\x8b\x08\x00 and no more"s, FileKind::kDamagedArchive},
  };
  for (const auto& [bytes, kind] : cases) {
    for (const char* name : {"misleading.obj", "data.npz"}) {
      WriteBytes(folder / name, bytes);
      EXPECT_EQ(Identify(folder / name).kind, kind)
          << bytes.substr(0, 30) << ": " << Describe(Identify(folder / name).kind);
      EXPECT_FALSE(Inspect(folder / name).findings.empty());
    }
  }
}

TEST(Inspect, WhatIsNotAFileIsSaidAndNeverOpened) {
  const TemporaryFolder folder;
  EXPECT_EQ(Inspect(folder / "nothing").identity.kind, FileKind::kMissing);
  EXPECT_EQ(Inspect(folder.Path()).identity.kind, FileKind::kFolder);
  EXPECT_EQ(Inspect("/dev/null").identity.kind, FileKind::kSpecial);
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_EQ(Inspect(folder / "pipe").identity.kind, FileKind::kSpecial);  // would hang otherwise
  WriteBytes(folder / "secret", "x");
  ASSERT_EQ(::chmod((folder / "secret").c_str(), 0), 0);
  if (::geteuid() != 0) {
    EXPECT_EQ(Inspect(folder / "secret").identity.kind, FileKind::kUnreadable);
  }
}

TEST(Inspect, TruncatedAndFlippedFilesAreSurvived) {
  const TemporaryFolder folder;
  const std::string clip = EmbeddedBytes("clips/demo_inspect.npz");
  const std::string mesh = EmbeddedBytes("objects/cube.ply");
  const std::string bvh =
      "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation "
      "Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 1\nFrame Time: "
      "0.03\n0 "
      "0 0 0 0 0\n";
  for (const std::string* whole : {&clip, &mesh, &bvh}) {
    const std::size_t step = std::max<std::size_t>(1, whole->size() / 60);
    for (std::size_t cut = 1; cut < whole->size(); cut += step) {
      WriteBytes(folder / "cut", whole->substr(0, cut));
      EXPECT_FALSE(Inspect(folder / "cut").findings.empty()) << cut;
      std::string flipped = *whole;
      flipped[cut] = static_cast<char>(flipped[cut] ^ 0x55);
      WriteBytes(folder / "flipped", flipped);
      EXPECT_FALSE(Inspect(folder / "flipped").findings.empty()) << cut;
    }
  }
  WriteBytes(folder / "half.npz", clip.substr(0, clip.size() / 2));
  const Inspection half = Inspect(folder / "half.npz");
  EXPECT_EQ(half.identity.kind, FileKind::kDamagedArchive);
  EXPECT_EQ(half.Worst(), Verdict::kFault);
}

TEST(Inspect, HeadersThatPromiseTooMuch) {
  using std::string_literals::operator""s;
  const TemporaryFolder folder;
  for (const std::string& bytes :
       {"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float "
        "x\nproperty "
        "float y\nproperty float z\nelement face 1\nproperty list uchar int "
        "vertex_indices\nend_header\n"s,
        "OFF\n2000000000 2000000000 0\n"s, "glTF\x02\0\0\0\xff\xff\xff\xff\xff\xff\xff\x7fJSON"s,
        "\xf0\xff\xff\x03\0\0\0\0{\"a\": 1"s + std::string(100, ' '), std::string(100'000, '[')}) {
    WriteBytes(folder / "promise", bytes);
    EXPECT_EQ(Inspect(folder / "promise").Worst(), Verdict::kFault) << bytes.substr(0, 20);
  }
}

TEST(Inspect, AnArchiveOfOtherArrays) {
  const TemporaryFolder folder;
  NpzWriter writer;
  writer.AddFloat64("apples", {3}, {1, 2, 3});
  writer.Write(folder / "other.npz");
  const Inspection inspection = Inspect(folder / "other.npz");
  EXPECT_EQ(inspection.identity.kind, FileKind::kNpz);
  EXPECT_EQ(inspection.Worst(), Verdict::kFault);
  EXPECT_THAT(All(inspection), HasSubstr("apples"));

  NpzWriter clip;  // a motion array of a length of its own
  clip.AddFloat64("mocap_frame_rate", {}, {30.0});
  clip.AddFloat64("trans", {4, 3}, std::vector<double>(12, 0.9));
  clip.AddFloat64("root_orient", {5, 3}, std::vector<double>(15, 0.1));
  clip.AddFloat64("pose_body", {4, 63}, std::vector<double>(252, 0.1));
  clip.Write(folder / "lengths.npz");
  EXPECT_THAT(All(Inspect(folder / "lengths.npz")), HasSubstr("different numbers of frames"));
}

TEST(Inspect, JsonLinesAreAListOfTheirValues) {
  const TemporaryFolder folder;
  const std::string line = "{\"timestamp_ns\": 1, \"tracked\": {\"0\": {\"pose\": [0.1]}}}\n";
  WriteBytes(folder / "hands.jsonl", line + line + "\n" + line);
  const Inspection hands = Inspect(folder / "hands.jsonl");
  EXPECT_EQ(hands.identity.kind, FileKind::kJson);
  EXPECT_EQ(hands.Worst(), Verdict::kFault);
  EXPECT_THAT(All(hands), HasSubstr("list of 3"));
  EXPECT_THAT(All(hands), HasSubstr("it has: timestamp_ns, tracked"));
  EXPECT_THAT(All(hands), ::testing::Not(HasSubstr("cut off")));
  WriteBytes(folder / "cut.jsonl", line + line.substr(0, 30));
  EXPECT_THAT(All(Inspect(folder / "cut.jsonl")), HasSubstr("ends within its JSON"));

  // A frame a line, as codes that write while they run do.
  std::string frames;
  for (int t = 0; t < 4; ++t) {
    frames +=
        "{\"global_orient\": [0, 0, 0.1], \"transl\": [0, 0, 1], \"fps\": 25, \"body_pose\": [";
    for (int i = 0; i < 63; ++i) frames += i == 0 ? "0.1" : ", 0";
    frames += "]}\n";
  }
  WriteBytes(folder / "frames.jsonl", frames);
  const Inspection motion = Inspect(folder / "frames.jsonl");
  EXPECT_NE(motion.Worst(), Verdict::kFault) << All(motion);
  EXPECT_THAT(All(motion), HasSubstr("4 frames at 25 Hz"));
}

// What import reads is not called unusable: matrices in a clip's names.
TEST(Inspect, ClipsInMatricesAreSoundAndAHandAloneIsToldItsModel) {
  const TemporaryFolder folder;
  NpzWriter body, hand;
  std::vector<double> identity;
  for (int k = 0; k < 15; ++k) identity.insert(identity.end(), {1, 0, 0, 0, 0, -1, 0, 1, 0});
  body.AddFloat64("trans", {1, 3}, {0, 0, 0.9});
  body.AddFloat64("mocap_frame_rate", {}, {30});
  body.AddFloat64("root_orient", {1, 3, 3}, {identity.begin(), identity.begin() + 9});
  body.AddFloat64("pose_body", {1, 63}, std::vector<double>(63, 0.01));
  body.Write(folder / "body.npz");
  const Inspection clip = Inspect(folder / "body.npz");
  EXPECT_EQ(clip.identity.kind, FileKind::kClip);
  EXPECT_THAT(All(clip), ::testing::Not(HasSubstr("axis-angle is needed")));
  EXPECT_THAT(All(clip), HasSubstr("AMASS, SMPL-X"));
  EXPECT_NE(clip.Worst(), Verdict::kFault) << All(clip);

  hand.AddFloat64("transl", {1, 3}, {0, 0, 1});
  hand.AddFloat64("global_orient", {1, 1, 3, 3}, {identity.begin(), identity.begin() + 9});
  hand.AddFloat64("hand_pose", {1, 15, 3, 3}, identity);
  hand.Write(folder / "hand.npz");
  const Inspection alone = Inspect(folder / "hand.npz");
  EXPECT_NE(alone.Worst(), Verdict::kFault) << All(alone);
  EXPECT_THAT(All(alone), HasSubstr("--body MANO_RIGHT.pkl"));
  ASSERT_EQ(alone.next.size(), 1U);  // no fit onto a body, which would fail
  EXPECT_THAT(alone.next[0], HasSubstr("holdfast import"));
  WriteBytes(folder / "MANO_RIGHT.pkl", "x");
  const Inspection beside = Inspect(folder / "hand.npz");
  ASSERT_EQ(beside.next.size(), 2U);
  EXPECT_THAT(beside.next[1], HasSubstr("--body " + ShellWord(folder / "MANO_RIGHT.pkl")));
}

TEST(Inspect, Meshes) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = ReadMeshBytes(EmbeddedBytes("objects/mug.ply"), "mug.ply").mesh;
  WriteMesh(mesh, folder / "mug.obj");
  const Inspection sound = Inspect(folder / "mug.obj");
  EXPECT_EQ(sound.Worst(), Verdict::kOk) << All(sound);

  WriteMesh({1000.0 * mesh.vertices, mesh.faces}, folder / "large.obj");
  const Inspection large = Inspect(folder / "large.obj");
  EXPECT_EQ(large.Worst(), Verdict::kWarning);
  EXPECT_THAT(All(large), HasSubstr("millimeters"));
  EXPECT_THAT(large.next.front(), HasSubstr("--object-scale 0.001"));

  WriteMesh({mesh.vertices, mesh.faces.leftCols(mesh.NumFaces() - 40)}, folder / "open.ply");
  EXPECT_THAT(All(Inspect(folder / "open.ply")), HasSubstr("not watertight"));

  fs::copy_file(folder / "open.ply", folder / "wrong.obj");
  const Inspection wrong = Inspect(folder / "wrong.obj");
  EXPECT_EQ(wrong.identity.kind, FileKind::kPly);
  EXPECT_THAT(All(wrong), HasSubstr("its content is .ply"));
}

// doctor says of a mesh what the commands that read it do.
TEST(Inspect, MeshesAsTheCommandsReadThem) {
  const fs::path cases = HOLDFAST_SOURCE_DIR "/tests/fixtures/cases";
  const Inspection fin = Inspect(cases / "mesh_fin/cup_fin.obj");
  EXPECT_EQ(fin.Worst(), Verdict::kWarning) << All(fin);
  EXPECT_THAT(All(fin), HasSubstr("Split the surface along 1 edge of more than two faces"));
  std::vector<std::string> notes;
  EXPECT_EQ(ForFitting(LoadObject(fin.path.string()), 300, &notes).NumVertices(), 300);
  EXPECT_THAT(notes, Contains(HasSubstr("Split the surface along 1 edge")));
  // Small ones as well, which no fit simplifies.
  const TemporaryFolder small;
  WriteBytes(
      small / "fin.obj",
      "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0.1 0.1 0\nv 0.05 0.05 0.1\nf 1 2 3\nf 3 2 4\nf 2 3 5\n");
  EXPECT_THAT(All(Inspect(small / "fin.obj")), HasSubstr("Split the surface along 1 edge"));
  for (const char* name : {"continued.obj", "trailing.stl"}) {
    const Inspection text = Inspect(cases / "mesh_text" / name);
    EXPECT_LT(text.Worst(), Verdict::kFault) << All(text);
    EXPECT_THAT(text.next, Contains(HasSubstr("holdfast fit"))) << name;
  }
  // A name and bytes of nothing known: what the reader says.
  const TemporaryFolder folder;
  for (const std::string name : {"cut.stl", "words.obj"}) {
    WriteBytes(folder / name, name == "cut.stl" ? std::string(200, '\x7f') : "Hello, world\n");
    const Inspection unread = Inspect(folder / name);
    EXPECT_EQ(unread.Worst(), Verdict::kFault) << All(unread);
    try {
      ReadMesh(folder / name);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_THAT(All(unread), HasSubstr(error.Problem()));
    }
  }
  // What a fit cannot simplify.
  TriangleMesh crumbs = ReadMeshBytes(EmbeddedBytes("objects/cube.ply"), "cube.ply").mesh;
  crumbs.faces = crumbs.faces.leftCols(1).eval();
  TriangleMesh many = crumbs;
  for (int i = 1; i < 150; ++i) {
    crumbs.vertices.row(0).array() += 0.2;
    Append(crumbs, many);
  }
  many.vertices *= 0.01;
  WriteMesh(many, folder / "crumbs.ply");
  const Inspection loose = Inspect(folder / "crumbs.ply");
  EXPECT_EQ(loose.Worst(), Verdict::kFault);
  EXPECT_THAT(All(loose), HasSubstr("150 loose parts"));
}

TEST(Inspect, SizesThatTwoUnitsExplain) {
  const fs::path cube = HOLDFAST_SOURCE_DIR "/tests/fixtures/cases/mesh_unit_guess/cube_20.stl";
  const std::string both =
      "millimeters, as usual for .stl files: --object-scale 0.001 makes it 2 x 2 x 2 cm; or in "
      "centimeters: --object-scale 0.01 makes it 20 x 20 x 20 cm";
  const Inspection stl = Inspect(cube);
  EXPECT_THAT(All(stl), HasSubstr(both));
  EXPECT_THAT(stl.next.front(), HasSubstr("--object-scale 0.001"));
  EXPECT_THAT(testing::ErrorText([&] { RequireHandheld(LoadObject(cube.string())); }),
              HasSubstr(both));
  // Another format has no custom.
  const TemporaryFolder folder;
  WriteMesh(ReadMesh(cube), folder / "cube.obj");
  EXPECT_THAT(
      All(Inspect(folder / "cube.obj")),
      HasSubstr("likely in centimeters: --object-scale 0.01 makes it 20 x 20 x 20 cm; or in "
                "millimeters: --object-scale 0.001 makes it 2 x 2 x 2 cm"));
}

TEST(Inspect, GltfMeshes) {
  const TemporaryFolder folder;
  // Three float vectors: 0 0 0, 1 0 0, 0 1 0.
  const std::string positions = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
  WriteBytes(
      folder / "triangle.gltf",
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"scale":[0.1,0.1,0.1]}],
                 "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
                 "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)" +
          positions + R"("}],"bufferViews":[{"buffer":0,"byteLength":36}],
                 "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]})");
  const Inspection gltf = Inspect(folder / "triangle.gltf");
  EXPECT_EQ(gltf.Worst(), Verdict::kWarning) << All(gltf);
  EXPECT_THAT(All(gltf), HasSubstr("1 mesh is placed by the nodes of the file"));
  EXPECT_THAT(gltf.next.front(), HasSubstr("holdfast fit"));
  EXPECT_NEAR(LoadObject((folder / "triangle.gltf").string()).mesh.vertices.maxCoeff(), 0.1, 1e-7);
}

TEST(Inspect, BodyModels) {
  const TemporaryFolder folder;
  WriteBytes(folder / "body.npz", EmbeddedBytes("body/holdfast_neutral.npz"));
  const Inspection body = Inspect(folder / "body.npz");
  EXPECT_EQ(body.identity.kind, FileKind::kBodyModel);
  EXPECT_EQ(body.Worst(), Verdict::kOk) << All(body);
  EXPECT_THAT(All(body), HasSubstr("the file's own lists"));

  // What is no model's tree is said.
  NpzWriter writer;
  writer.AddFloat64("v_template", {4, 3}, std::vector<double>(12, 0.1));
  writer.AddInt64("kintree_table", {2, 24}, std::vector<std::int64_t>(48, 0));
  writer.Write(folder / "other.npz");
  const Inspection other = Inspect(folder / "other.npz");
  EXPECT_EQ(other.identity.kind, FileKind::kBodyModel);
  EXPECT_EQ(other.Worst(), Verdict::kFault);
}

TEST(Inspect, PicklesAreReadAndNeverExecuted) {
  if (std::system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-numpy is not installed";
  }
  const TemporaryFolder folder;
  const std::string marker = (folder / "executed").string();
  std::ofstream(folder / "write.py")
      << "import os, pickle, sys, numpy as np\n"
         "os.chdir(sys.argv[1])\n"
         "m = dict(left_hand=np.arange(778), right_hand=np.arange(778))\n"
         "class Bad:\n"
         "  def __reduce__(self): return (os.system, ('touch executed',))\n"
         "for p in range(pickle.HIGHEST_PROTOCOL + 1):\n"
         "  pickle.dump(m, open('ids%d.pkl' % p, 'wb'), protocol=p)\n"
         "  pickle.dump(dict(body_pose=Bad()), open('bad%d.pkl' % p, 'wb'), protocol=p)\n";
  ASSERT_EQ(std::system(("/usr/bin/python3 '" + (folder / "write.py").string() + "' '" +
                         folder.Path().string() + "'")
                            .c_str()),
            0);
  for (int protocol = 0; protocol <= 5; ++protocol) {
    const Inspection ids = Inspect(folder / ("ids" + std::to_string(protocol) + ".pkl"));
    EXPECT_EQ(ids.identity.kind, FileKind::kPickle) << protocol;
    EXPECT_THAT(ids.title, HasSubstr("vertices of the hands")) << protocol;
    EXPECT_EQ(ids.Worst(), Verdict::kOk) << All(ids);
    const Inspection bad = Inspect(folder / ("bad" + std::to_string(protocol) + ".pkl"));
    EXPECT_EQ(bad.identity.kind, FileKind::kPickle) << protocol;
    EXPECT_EQ(bad.Worst(), Verdict::kFault);
    EXPECT_THAT(All(bad), HasSubstr("system")) << protocol;
  }
  EXPECT_FALSE(fs::exists(marker));
}

// Every real file is what its folder says; the few that are unusable are known.
TEST(Inspect, RealFiles) {
  const fs::path data = testing::DataFolder();
  if (!fs::exists(data / "mocap")) GTEST_SKIP() << "no real motion in " << data;
  int files = 0, faults = 0, texts = 0, decided = 0, motions = 0;
  for (const auto& entry : fs::recursive_directory_iterator(data)) {
    const std::string folder = fs::relative(entry.path(), data).begin()->string();
    if (!entry.is_regular_file() || (folder != "mocap" && folder != "objects")) continue;
    const std::string name = entry.path().filename().string();
    const auto expected = name.ends_with(".bvh.gz")   ? FileKind::kBvh
                          : name.ends_with(".amc.gz") ? FileKind::kAmc
                          : name.ends_with(".asf.gz") ? FileKind::kAsf
                          : name.ends_with(".obj")    ? FileKind::kObj
                                                      : FileKind::kText;
    if (files % 7 == 0 || expected == FileKind::kObj || expected == FileKind::kText) {
      const Inspection inspection = Inspect(entry.path());
      EXPECT_EQ(inspection.identity.kind, expected) << entry.path();
      faults += inspection.Worst() == Verdict::kFault;
      texts += expected == FileKind::kText;  // licenses, which nothing reads
      for (const Fact& fact : inspection.facts) {
        if (fact.name != "up_axis") continue;
        ++motions;
        const std::string axis = std::get<std::string>(fact.value);
        EXPECT_TRUE(axis == "y" || axis == "undecided") << entry.path() << ": " << axis;
        decided += axis == "y";
      }
    } else {
      EXPECT_EQ(Identify(entry.path()).kind, expected) << entry.path();
    }
    ++files;
  }
  EXPECT_LE(faults - texts, 1);  // 16_11.amc was made with another skeleton
  EXPECT_GT(decided, 0.95 * motions);
}

TEST(Inspect, TheAxisOfAMotionIsTheOneThatImportTakes) {
  const Inspection inspection =
      Inspect(HOLDFAST_SOURCE_DIR "/tests/fixtures/cases/bvh_z_up/zup.bvh");
  EXPECT_EQ(inspection.Worst(), Verdict::kOk);
  EXPECT_THAT(All(inspection),
              HasSubstr("z is up (in 100 % of frames): all commands use this axis"));
}

TEST(ShellWord, QuotesWhatHasToBe) {
  EXPECT_EQ(ShellWord("a/b-c.npz"), "a/b-c.npz");
  EXPECT_EQ(ShellWord("a b.npz"), "'a b.npz'");
  EXPECT_EQ(ShellWord("it's"), "'it'\\''s'");
  EXPECT_EQ(ShellWord("-rf"), "./'-rf'");
  EXPECT_EQ(ShellWord("$(x)"), "'$(x)'");
  EXPECT_EQ(Stem("x/walk.bvh.gz"), "walk");
}

}  // namespace
}  // namespace holdfast
