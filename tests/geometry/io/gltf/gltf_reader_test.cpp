// SPDX-License-Identifier: MIT
#include "geometry/io/gltf/gltf_reader.h"

#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/gltf/gltf_skeleton.h"
#include "geometry/rotation.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/zip_bytes.h"

namespace holdfast {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TemporaryFolder;

const std::filesystem::path kFixtures =
    std::filesystem::path(HOLDFAST_SOURCE_DIR) / "tests/fixtures/gltf";

int Joint(const SourceMotion& motion, const std::string& name) {
  for (int j = 0; j < motion.NumJoints(); ++j) {
    const std::string& own = motion.joint_names[static_cast<std::size_t>(j)];
    if (own == name || own == "mixamorig:" + name) return j;
  }
  throw std::runtime_error("no joint " + name);
}

// What three.js shows of a file at some times, by node name.
struct Shown {
  double time;
  std::map<std::string, Eigen::Matrix4d> nodes;
};

std::vector<Shown> ShownBy3js(const std::string& file) {
  const json all = json::parse(ReadFile(kFixtures / "expected.json"));
  std::vector<Shown> result;
  for (const json& entry : all[file]) {
    Shown shown{entry["time"], {}};
    for (const auto& [name, values] : entry["nodes"].items()) {
      Eigen::Matrix4d matrix;
      for (int k = 0; k < 16; ++k) matrix(k % 4, k / 4) = values[static_cast<std::size_t>(k)];
      shown.nodes[name] = matrix;
    }
    result.push_back(std::move(shown));
  }
  return result;
}

// Every joint stands where three.js puts it, and turns as it does there from frame to frame.
void ExpectAsShown(const std::string& file, double frame_rate, const std::string& animation,
                   const Eigen::Vector3d& mirror = Eigen::Vector3d::Ones()) {
  GltfMotionOptions options;
  options.frame_rate = frame_rate;
  options.animation = animation;
  const SourceMotion motion = ReadGltfMotion(kFixtures / file, options);
  const std::vector<Shown> shown = ShownBy3js(file);
  ASSERT_GE(shown.size(), 2u);
  const auto rotation = [&](const Shown& at, const std::string& name) {
    return RotationWithin(mirror.asDiagonal() * at.nodes.at(name).topLeftCorner<3, 3>());
  };
  for (const Shown& at : shown) {
    const auto t = static_cast<int>(std::lround(at.time * frame_rate));
    ASSERT_NEAR(t, at.time * frame_rate, 1e-6) << "times of the file must be frames of the test";
    ASSERT_LT(t, motion.NumFrames());
    int compared = 0;
    for (const auto& [name, matrix] : at.nodes) {
      if (name == "cup") continue;
      const int j = Joint(motion, name);
      const Eigen::Vector3d place = mirror.asDiagonal() * matrix.topRightCorner<3, 1>();
      EXPECT_LT((motion.positions[static_cast<std::size_t>(t)].col(j) - place).norm(), 1e-4)
          << name << " at " << at.time;
      const Eigen::Matrix3d moved = motion.Rotation(t, j).toRotationMatrix() *
                                    motion.Rotation(0, j).toRotationMatrix().transpose();
      EXPECT_LT(AngleBetween(moved, rotation(at, name) * rotation(shown[0], name).transpose()),
                3e-3)
          << name << " at " << at.time;
      ++compared;
    }
    EXPECT_EQ(compared, motion.NumJoints());
    if (const auto cup = at.nodes.find("cup"); cup != at.nodes.end()) {
      ASSERT_TRUE(motion.prop);
      EXPECT_LT((motion.prop->positions.col(t) - cup->second.topRightCorner<3, 1>()).norm(), 3e-5);
      EXPECT_LT(AngleBetween(motion.prop->rotations[static_cast<std::size_t>(t)].toRotationMatrix(),
                             rotation(at, "cup")),
                1e-3);
    }
  }
}

TEST(GltfReader, CubicSplinesShortsAndStepsAreWhatThreeJsShows) {
  ExpectAsShown("mixamo.glb", 30, "dance");
}

TEST(GltfReader, MatricesSparseValuesAndBase64AreWhatThreeJsShows) {
  ExpectAsShown("matrices.gltf", 20, "walk");
}

TEST(GltfReader, AMirroredSceneIsTakenOutOfItsMirror) {
  ExpectAsShown("mirrored.gltf", 120, "walk", {-1, 1, 1});
  const SourceMotion motion = ReadGltfMotion(kFixtures / "mirrored.gltf");
  EXPECT_THAT(motion.notes, Contains(HasSubstr("mirrors its character")));
  EXPECT_EQ(motion.frame_rate, 24);
  EXPECT_EQ(motion.NumFrames(), 6);
  // The character's left is where a character that faces +z has it.
  EXPECT_GT(motion.rest_offsets(0, Joint(motion, "LeftUpLeg")), 0.05);
  EXPECT_GT(motion.positions[0](0, Joint(motion, "LeftUpLeg")), 0.05);
}

// Centimeters, z up, below a node that makes meters, y up of it.
TEST(GltfReader, RestsAsSkinnedUprightInMeters) {
  const SourceMotion motion = ReadGltfMotion(kFixtures / "mixamo.glb");
  EXPECT_EQ(motion.format, "glTF");
  EXPECT_EQ(motion.NumJoints(), 37);
  EXPECT_EQ(motion.parents[0], -1);
  EXPECT_EQ(motion.joint_names[0], "mixamorig:Hips");
  const auto rest = [&](const std::string& name) -> Eigen::Vector3d {
    return motion.rest_offsets.col(Joint(motion, name));
  };
  EXPECT_LT((rest("LeftForeArm") - Eigen::Vector3d(0.27, 0, -0.01)).norm(), 1e-5);
  EXPECT_LT((rest("RightLeg") - Eigen::Vector3d(-0.01, -0.4, 0.01)).norm(), 1e-5);
  EXPECT_LT((rest("Head") - Eigen::Vector3d(0, 0.09, 0.02)).norm(), 1e-5);
}

TEST(GltfReader, TakesTheLongestAnimationAndTellsSo) {
  const SourceMotion motion = ReadGltfMotion(kFixtures / "mixamo.glb");
  EXPECT_EQ(motion.frame_rate, 15);
  EXPECT_EQ(motion.NumFrames(), 13);
  EXPECT_THAT(motion.notes, Contains(AllOf(HasSubstr("2 animations"), HasSubstr("'short'"),
                                           HasSubstr("'dance' is used"))));
  GltfMotionOptions options;
  options.animation = "short";
  const SourceMotion other = ReadGltfMotion(kFixtures / "mixamo.glb", options);
  EXPECT_EQ(other.frame_rate, 30);
  EXPECT_EQ(other.NumFrames(), 4);
  EXPECT_THAT(other.notes, IsEmpty());
  EXPECT_FALSE(other.prop);  // the cup stands still there
}

TEST(GltfReader, TheThingBesideTheBodyComesWithItsMesh) {
  const SourceMotion motion = ReadGltfMotion(kFixtures / "mixamo.glb");
  ASSERT_TRUE(motion.prop);
  EXPECT_EQ(motion.prop->name, "cup");
  ASSERT_EQ(motion.prop->mesh.NumVertices(), 4);
  ASSERT_EQ(motion.prop->mesh.faces.cols(), 4);
  // Its node scales by a half.
  EXPECT_LT(
      (motion.prop->mesh.vertices.rowwise().maxCoeff() - Eigen::Vector3d(0.05, 0.1, 0.15)).norm(),
      1e-6);
  EXPECT_NEAR(motion.prop->mesh.vertices.minCoeff(), 0, 1e-12);
}

TEST(GltfReader, IrregularKeysAreSampledAtACommonRate) {
  const SourceMotion motion = ReadGltfMotion(kFixtures / "matrices.gltf");
  EXPECT_EQ(motion.frame_rate, 100);  // 0.1, 0.25, 0.47, 0.61, 0.71 s
  EXPECT_EQ(motion.NumFrames(), 72);
}

TEST(GltfReader, AsksWhichOfTwoCharacters) {
  EXPECT_THAT(testing::ErrorText([] { ReadGltfMotion(kFixtures / "two.glb"); }),
              AllOf(HasSubstr("two.glb"), HasSubstr("'left', 'right'"), HasSubstr("--character")));
  GltfMotionOptions options;
  for (const auto& [name, x] : {std::pair{"left", 1.0}, std::pair{"right", -1.0}}) {
    options.character = name;
    const SourceMotion motion = ReadGltfMotion(kFixtures / "two.glb", options);
    EXPECT_EQ(motion.NumJoints(), 37);
    EXPECT_NEAR(motion.positions[0](0, 0), x, 1e-6);
  }
  options.character = "middle";
  EXPECT_THROW(ReadGltfMotion(kFixtures / "two.glb", options), Error);
}

TEST(GltfReader, KnowsItsFilesByContent) {
  EXPECT_TRUE(LooksLikeGltf(ReadFile(kFixtures / "mixamo.glb").substr(0, 100)));
  EXPECT_TRUE(LooksLikeGltf(ReadFile(kFixtures / "matrices.gltf").substr(0, 4096)));
  EXPECT_TRUE(LooksLikeGltf("\n {\"accessors\": ["));
  EXPECT_FALSE(LooksLikeGltf("{\"LeftArm\": \"left_shoulder\"}"));
  EXPECT_FALSE(LooksLikeGltf("HIERARCHY"));
  EXPECT_FALSE(LooksLikeGltf(""));
}

// A small sound file, to be damaged: three joints in a row, turning about z, one key a second.
class HostileGltf : public ::testing::Test {
 protected:
  HostileGltf() {
    const auto add = [&](const std::vector<float>& values, int rows, const char* type) {
      const std::size_t offset = bytes_.size();
      bytes_.resize(offset + 4 * values.size());
      std::memcpy(bytes_.data() + offset, values.data(), 4 * values.size());
      asset_["bufferViews"].push_back(
          {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", 4 * values.size()}});
      asset_["accessors"].push_back({{"bufferView", asset_["bufferViews"].size() - 1},
                                     {"componentType", 5126},
                                     {"count", values.size() / static_cast<std::size_t>(rows)},
                                     {"type", type}});
    };
    asset_["asset"] = {{"version", "2.0"}};
    add({0, 1, 2}, 1, "SCALAR");
    add({0, 0, 0, 1, 0, 0, 0.6f, 0.8f, 0, 0, 1, 0}, 4, "VEC4");
    add({0, 0, 0, 1, 2, 3, 4, 5, 6}, 3, "VEC3");
    asset_["nodes"] = {{{"name", "a"}, {"children", {1}}},
                       {{"name", "b"}, {"children", {2}}, {"translation", {0, 1, 0}}},
                       {{"name", "c"}, {"translation", {0, 1, 0}}}};
    asset_["skins"] = {{{"joints", {0, 1, 2}}}};
    asset_["animations"] = {
        {{"name", "turn"},
         {"samplers", {{{"input", 0}, {"output", 1}}, {{"input", 0}, {"output", 2}}}},
         {"channels",
          {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "rotation"}}}},
           {{"sampler", 1}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
  }

  float& Float(std::size_t i) { return reinterpret_cast<float*>(bytes_.data())[i]; }

  std::string Glb() {
    asset_["buffers"] = {{{"byteLength", bytes_.size()}}};
    std::string text = asset_.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const auto word = [](std::size_t value) { return testing::LittleEndian(value, 4); };
    return "glTF" + word(2) + word(28 + text.size() + bytes_.size()) + word(text.size()) + "JSON" +
           text + word(bytes_.size()) + std::string("BIN\0", 4) + bytes_;
  }

  SourceMotion Read(const GltfMotionOptions& options = {}) {
    return ParseGltfMotion(Glb(), "bad.glb", folder_.Path(), options);
  }

  // Fails soon, with an Error that names the file and says this.
  void ExpectFault(const std::string& part) { ExpectFaultOf(Glb(), part); }
  void ExpectFaultOf(const std::string& bytes, const std::string& part) {
    const auto start = std::chrono::steady_clock::now();
    EXPECT_THAT(testing::ErrorText([&] { ParseGltfMotion(bytes, "bad.glb", folder_.Path(), {}); }),
                AllOf(HasSubstr("bad.glb"), HasSubstr(part)));
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
  }

  TemporaryFolder folder_;
  json asset_;
  std::string bytes_;
};

TEST_F(HostileGltf, IsSoundBeforeItIsDamaged) {
  const SourceMotion motion = Read();
  ASSERT_EQ(motion.NumFrames(), 3);
  EXPECT_EQ(motion.frame_rate, 1);
  EXPECT_LT((motion.positions[2].col(2) - Eigen::Vector3d(4, 5, 6)).norm(), 1e-6);  // half a turn
  EXPECT_LT((motion.positions[0].col(2) - Eigen::Vector3d(0, 2, 0)).norm(), 1e-6);
}

TEST_F(HostileGltf, ValuesThatAreWrong) {
  struct Fault {
    std::string place;
    json value;
    std::string part;
  };
  // 1.0f and 2.0f are no small integers.
  const json sparse = {{"count", 2},
                       {"indices", {{"bufferView", 0}, {"componentType", 5125}}},
                       {"values", {{"bufferView", 2}}}};
  const json sound = asset_;
  const std::vector<Fault> faults = {
      {"/nodes/2/children", json::array({0}), "cycle"},
      {"/nodes/0/children", json::array({1, 2}), "already a child"},
      {"/nodes/2/children", json::array({77}), "[nodes][2][children]"},
      {"/skins/0/joints/1", 9, ""},
      {"/skins/0/joints/1", -1, ""},
      {"/skins/0/joints/1", "b", ""},
      {"/skins/0/joints/1", 1.5, ""},
      {"/skins/0/inverseBindMatrices", 12, ""},
      {"/nodes/0/mesh", 0, ""},
      {"/nodes/0/skin", 1, ""},
      {"/accessors/0/bufferView", 3, ""},
      {"/accessors/0/componentType", 1, ""},
      {"/accessors/0/componentType", 5124, ""},
      {"/accessors/0/type", "VEC9", ""},
      {"/accessors/0/count", 4, "[accessors]"},
      {"/accessors/0/count", 2147483648, "[accessors]"},
      {"/accessors/0/count", 4611686018427387904, "[accessors]"},
      {"/accessors/1/byteOffset", 4, "more than its buffer"},
      {"/accessors/2/sparse", sparse, "sparse indices"},
      {"/bufferViews/0/buffer", 1, ""},
      {"/bufferViews/0/byteLength", -4, ""},
      {"/bufferViews/0/byteOffset", 18446744073709551615ull, ""},
      {"/bufferViews/1/byteStride", 20, "more than its buffer"},
      {"/bufferViews/2/byteLength", 1000, "more than its buffer"},
      {"/animations/0/samplers/0/input", 5, ""},
      {"/animations/0/samplers/0/output", 4294967296, ""},
      {"/animations/0/samplers/0/interpolation", "CUBICSPLINE", "3 values for 3 keys"},
      {"/animations/0/samplers/0/interpolation", "BEZIER", "none of LINEAR"},
      {"/animations/0/channels", json::array(), "move no joint"},
      {"/animations/0/channels/0/sampler", 2, ""},
      {"/animations/0/channels/0/target/node", 1000000, ""},
      {"/nodes/0/translation", json::array({1, 2}), ""},
      {"/nodes/0/rotation", json::array({0, 0, 0, 0}), ""},
      {"/nodes/0/matrix", json::array({1}), ""},
      {"/nodes", 3, ""},
      {"/animations", "none", ""},
      {"/asset", nullptr, ""},
      {"/asset/version", "1.0", ""}};
  for (const Fault& fault : faults) {
    asset_ = sound;
    asset_[json::json_pointer(fault.place)] = fault.value;
    SCOPED_TRACE(fault.place + " = " + fault.value.dump());
    ExpectFault(fault.part);
  }
}

TEST_F(HostileGltf, ZerosThatTakeNoRoomInTheFile) {
  asset_["accessors"][0].erase("bufferView");
  asset_["accessors"][0]["count"] = 2147483648;
  ExpectFault("holds none");
}

TEST_F(HostileGltf, KeysThatAreNoNumbersOrOutOfOrder) {
  const std::string sound = bytes_;
  const auto with = [&](std::size_t at, float value, const std::string& part) {
    bytes_ = sound;
    Float(at) = value;
    ExpectFault(part);
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  with(0, nan, "holds nan as the time of key 0");
  with(1, std::numeric_limits<float>::infinity(), "inf");
  with(1, -3, "goes from 0 s back to -3 s");
  with(3 + 5, nan, "holds nan in element 1");
}

TEST_F(HostileGltf, QuaternionsOfLengthZero) {
  for (std::size_t k = 7; k < 11; ++k) Float(k) = 0;
  ExpectFault("of zero length in element 1");
}

TEST_F(HostileGltf, FilesCutShortAnywhere) {
  const std::string whole = Glb();
  for (std::size_t size = 4; size < whole.size(); size += 7) {
    ExpectFaultOf(whole.substr(0, size), "");
  }
  std::string longer = whole;
  longer[12] = static_cast<char>(0xFF);  // the JSON chunk's length
  longer[15] = static_cast<char>(0x7F);
  ExpectFaultOf(longer, "chunk");
  ExpectFaultOf("{", "");
  ExpectFaultOf("", "");
  ExpectFaultOf(std::string(100000, '['), "levels deep");
  ExpectFaultOf("{\"asset\":{\"version\":\"2.0\",\"extras\":" + std::string(200000, '[') +
                    std::string(200000, ']') + "}}",
                "levels deep");
}

TEST_F(HostileGltf, AMinuteOfFramesForeverFromTwoKeys) {
  Float(2) = 3e37f;
  ExpectFault("far more than a file");
  Float(1) = 1e-45f;
  ExpectFault("far more than a file");
}

TEST_F(HostileGltf, PlacesOutOfThisWorld) {
  Float(3 + 12 + 4) = 3e38f;
  ExpectFault("from the origin");
}

// Scales multiply from node to node, beyond what numbers hold.
TEST_F(HostileGltf, ScalesThatOverflow) {
  for (json& node : asset_["nodes"]) node["scale"] = {1e200, 1e200, 1e200};
  ExpectFault("");
}

TEST_F(HostileGltf, BuffersThatLieElsewhere) {
  const TemporaryFolder other;
  std::ofstream(other / "secret.bin") << std::string(1000, 'x');
  std::filesystem::create_symlink(other / "secret.bin", folder_ / "link.bin");
  asset_["buffers"] = {{{"byteLength", 84}}};
  const json sound = asset_;
  const auto fault = [&](const std::string& uri, const std::string& part) {
    asset_ = sound;
    asset_["buffers"][0]["uri"] = uri;
    SCOPED_TRACE(uri);
    ExpectFaultOf(asset_.dump(), part);
  };
  fault("http://example.com/a.bin", "nothing is downloaded");
  fault("file:///etc/passwd", "nothing is downloaded");
  fault("/etc/passwd", "not in the folder");
  fault("../secret.bin", "not in the folder");
  fault("a/../../secret.bin", "not in the folder");
  fault("%2e%2e/secret.bin", "not in the folder");
  fault("..\\secret.bin", "not in the folder");
  fault("link.bin", "points outside");
  fault("missing.bin", "was not found");
  fault(".", "was not found");
  fault("", "");
  fault("data:application/octet-stream;base64,AAAA", "declares 84 bytes but has 3");
  fault("data:application/octet-stream;base64,A*AA", "base64");
  fault("data:text/plain,hello", "base64");
  std::ofstream(folder_ / "short.bin") << "abc";
  fault("short.bin", "declares 84 bytes but has 3");
}

TEST_F(HostileGltf, CompressedBuffersAreNamed) {
  asset_["bufferViews"][0]["extensions"] = {{"EXT_meshopt_compression", {{"buffer", 0}}}};
  ExpectFault("EXT_meshopt_compression");
}

TEST_F(HostileGltf, NoCharacterAndNoAnimation) {
  const json sound = asset_;
  asset_.erase("skins");
  ExpectFault("no skinned character");
  asset_ = sound;
  asset_.erase("animations");
  ExpectFault("no animation");
}

// A chain as deep as the limit allows: nothing here recurses.
TEST_F(HostileGltf, ADeepChainOfNodes) {
  json nodes = json::array();
  for (int k = 0; k < 90'000; ++k) nodes.push_back({{"children", {k + 1}}});
  nodes.push_back(json::object());
  asset_["nodes"] = nodes;
  asset_["skins"][0]["joints"] = {0, 1, 90'000};
  ExpectFault("more than 1000 joints");
}

}  // namespace
}  // namespace holdfast
