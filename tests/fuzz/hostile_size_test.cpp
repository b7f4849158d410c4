// SPDX-License-Identifier: MIT
// Hostile inputs of megabytes, which fuzzers never get to: what takes more than its share of time
// or memory shows only here.
#include <algorithm>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/fuzz/fuzz_target.h"

namespace holdfast::fuzz {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double kMaxSeconds = 20;
#else
constexpr double kMaxSeconds = 2;
#endif

std::string Repeat(std::string_view text, std::size_t count) {
  std::string repeated;
  repeated.reserve(text.size() * count);
  for (std::size_t i = 0; i < count; ++i) repeated += text;
  return repeated;
}

std::string Numbered(std::size_t count, const std::function<std::string(std::size_t)>& part) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += part(i);
  return text;
}

std::string LittleEndian(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> 8 * i & 0xff);
  return text;
}

struct Case {
  std::string_view target;
  std::string_view name;
  std::function<std::string()> make;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.target << " " << c.name; }

std::string StillJoints(std::size_t joints, std::size_t frames) {
  return "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n" +
         Repeat("JOINT a\n{\nOFFSET 0 0 0\n", joints - 1) + Repeat("}\n", joints) +
         fmt::format("MOTION\nFrames: {}\nFrame Time: 0.01\n", frames) + Repeat("0\n", frames);
}

std::string StillBones(std::size_t bones, std::size_t frames) {
  return ":root\norder RX\naxis XYZ\nposition 0 0 0\norientation 0 0 0\n:bonedata\n" +
         Numbered(bones, [](std::size_t i) { return fmt::format("begin\nname b{}\nend\n", i); }) +
         ":hierarchy\nbegin\nroot" +
         Numbered(bones, [](std::size_t i) { return fmt::format(" b{}", i); }) + "\nend\n\n----\n" +
         Repeat("1\nroot 0\n", frames);
}

std::string PlyHeader(std::string_view format, std::string_view type, std::size_t vertices,
                      std::size_t faces) {
  return fmt::format(
      "ply\nformat {0} 1.0\nelement vertex {2}\nproperty {1} x\nproperty {1} y\nproperty {1} z\n"
      "element face {3}\nproperty list uchar int vertex_indices\nend_header\n",
      format, type, vertices, faces);
}

std::string OnePolygon(std::size_t corners) {
  return Numbered(corners, [](std::size_t i) { return fmt::format("v {} {} 0\n", i, i % 7); }) +
         "f" + Numbered(corners, [](std::size_t i) { return fmt::format(" {}", i + 1); }) + "\n";
}

std::string ManyTensors(std::size_t count) {
  std::string header = "{";
  for (std::size_t i = 0; i < count; ++i) {
    header += fmt::format(R"({}"t{}":{{"dtype":"F32","shape":[0],"data_offsets":[0,0]}})",
                          i == 0 ? "" : ",", i);
  }
  header += "}";
  return LittleEndian(header.size(), 8) + header;
}

std::string GltfOf(std::string json) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  return "glTF" + LittleEndian(2, 4) + LittleEndian(20 + json.size(), 4) +
         LittleEndian(json.size(), 4) + "JSON" + json;
}

const Case kCases[] = {
    {"bvh", "JointsThatNeverMove", [] { return StillJoints(990, 200'000); }},
    {"bvh", "OneDeepChain",
     [] { return "HIERARCHY " + Repeat("ROOT a { OFFSET 0 0 0 ", 200'000); }},
    {"bvh", "NumbersWithoutEnd", [] { return StillJoints(3, 1) + Repeat("0 ", 2'000'000); }},
    {"amc", "BonesThatNeverMove", [] { return StillBones(900, 200'000); }},
    {"amc", "CommentsOnly", [] { return Repeat("#\n", 2'000'000); }},
    {"obj", "OnePolygon", [] { return OnePolygon(200'000); }},
    {"obj", "LastLineIsBad",
     [] { return Repeat("v 0 0 0\n", 600'000) + Repeat("f 1 2 3\n", 300'000) + "f 1 2 x\n"; }},
    {"off", "LastLineIsBad",
     [] {
       return "OFF\n600000 300000 0\n" + Repeat("0 0 0\n", 600'000) + Repeat("3 0 1 2\n", 299'999) +
              "3 0 1 x\n";
     }},
    {"ply", "BytesAsPositions",
     [] {
       return PlyHeader("binary_little_endian", "uchar", 1'500'000, 1) +
              std::string(4'500'000, '\1') + "\3" + std::string(12, '\0');
     }},
    {"ply", "LastFaceIsBad",
     [] {
       return PlyHeader("ascii", "float", 500'000, 250'000) + Repeat("0 0 0\n", 500'000) +
              Repeat("3 0 1 2\n", 249'999) + "3 0 1 x\n";
     }},
    {"ply", "EmptyLists",
     [] {
       return "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty "
              "float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\n"
              "element junk 4000000\nproperty list uchar double d\nend_header\n" +
              std::string(36, '\0') + "\3" + std::string(12, '\0') + std::string(4'000'000, '\0');
     }},
    {"stl", "NeverEnds",
     [] {
       return "solid\n" + Repeat("outer\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n", 80'000);
     }},
    {"skeleton_map", "Deep", [] { return std::string(1'000'000, '['); }},
    {"skeleton_map", "Wide", [] { return "{\"a\":[" + Repeat("0,", 500'000) + "0]}"; }},
    {"data_file", "DeepJson", [] { return std::string(8'000'000, '['); }},
    {"data_file", "JsonOfEmptyLists", [] { return "{\"a\":[" + Repeat("[],", 3'000'000) + "1]}"; }},
    {"data_file", "JsonOfNumbers", [] { return "{\"a\":[" + Repeat("0,", 4'000'000) + "x]}"; }},
    {"data_file", "JsonOfNames",
     [] {
       return "{" + Numbered(500'000, [](auto i) { return fmt::format("\"{}\":0,", i); }) + "x";
     }},
    {"pickle", "EmptyLists", [] { return "\x80\x02](" + std::string(6'000'000, ']') + "e."; }},
    {"pickle", "EmptyDicts", [] { return "\x80\x02](" + std::string(6'000'000, '}') + "e."; }},
    {"pickle", "Marks", [] { return "\x80\x02" + std::string(8'000'000, '('); }},
    {"pickle", "DictsWithItems",
     [] { return "\x80\x02](" + Repeat("(I1\nI2\ndI3\nI4\ns", 400'000); }},
    {"pickle", "Classes",
     [] { return "\x80\x02](" + Repeat("cnumpy\nndarray\n", 400'000) + "e."; }},
    {"safetensors", "ManyEmptyTensors", [] { return ManyTensors(12'000); }},
    {"safetensors", "EndsInItsHeader",
     [] {
       std::string bytes = ManyTensors(60'000);
       bytes[2'000'000] = '!';
       return bytes;
     }},
    {"gltf", "EmptyNodes",
     [] {
       return GltfOf("{\"asset\":{\"version\":\"2.0\"},\"nodes\":[" + Repeat("{},", 1'500'000) +
                     "{}]}");
     }},
    {"gltf", "DeepJson", [] { return GltfOf("{\"a\":" + std::string(6'000'000, '[')); }},
};

class HostileSize : public testing::TestWithParam<Case> {};

TEST_P(HostileSize, TakesNoMoreThanItsShare) {
  const auto target = std::find_if(Targets().begin(), Targets().end(), [](const FuzzTarget& known) {
    return known.name == GetParam().target;
  });
  ASSERT_NE(target, Targets().end());
  const std::string bytes = GetParam().make();
  Outcome outcome;
  ASSERT_NO_THROW(outcome = fuzz::Run(*target, std::as_bytes(std::span(bytes))));
  EXPECT_LT(outcome.seconds, kMaxSeconds);
  RecordProperty("peak_mb", static_cast<int>(outcome.peak_bytes >> 20));
}

INSTANTIATE_TEST_SUITE_P(Megabytes, HostileSize, testing::ValuesIn(kCases), [](const auto& shown) {
  return fmt::format("{}_{}", shown.param.target, shown.param.name);
});

}  // namespace
}  // namespace holdfast::fuzz
