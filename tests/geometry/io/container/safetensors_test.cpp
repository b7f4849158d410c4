// SPDX-License-Identifier: MIT
#include "geometry/io/container/safetensors.h"

#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/zip_bytes.h"

namespace holdfast {
namespace {

using testing::BytesOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::LittleEndian;
using testing::TemporaryFolder;

const std::filesystem::path kFixtures = HOLDFAST_SOURCE_DIR "/tests/fixtures";

std::string FileOf(const std::string& header, const std::string& data) {
  return LittleEndian(header.size(), 8) + header + data;
}

SafetensorsReader SafetensorsOf(const std::string& bytes) {
  return SafetensorsReader(ByteSource(std::as_bytes(std::span(bytes)), "net.safetensors"));
}

std::string Refusal(const std::string& bytes) {
  return testing::ErrorText([&] { SafetensorsOf(bytes); });
}

TEST(SafetensorsReader, ReadsEveryTypeOfAFileWrittenByTheFormatsDefinition) {
  const SafetensorsReader reader(kFixtures / "safetensors/all_types.safetensors");
  EXPECT_EQ(reader.Metadata(), (SafetensorsMetadata{{"format", "pt"}, {"version", "1"}}));
  const auto numbers = [&](const char* name) { return reader.Read(name).AsDoubles(); };
  EXPECT_THAT(numbers("bool"), ElementsAre(1, 0, 1));
  EXPECT_THAT(numbers("u8"), ElementsAre(0, 255));
  EXPECT_THAT(numbers("i8"), ElementsAre(-128, 127));
  EXPECT_THAT(numbers("u16"), ElementsAre(0, 65535));
  EXPECT_THAT(numbers("i16"), ElementsAre(-32768, 32767));
  EXPECT_THAT(numbers("f16"), ElementsAre(1.5, -2.0));
  EXPECT_THAT(numbers("bf16"), ElementsAre(1.5, -2.0));
  EXPECT_THAT(numbers("u32"), ElementsAre(4294967295.0));
  EXPECT_THAT(numbers("i32"), ElementsAre(-2147483648.0));
  EXPECT_THAT(numbers("f32"), ElementsAre(1.0, 2.0, 3.0, 4.5));
  EXPECT_THAT(reader.Read("u64").AsIntegers(), ElementsAre(std::int64_t{1} << 53));
  EXPECT_THAT(reader.Read("i64").AsIntegers(), ElementsAre(-(std::int64_t{1} << 53)));
  EXPECT_THAT(numbers("f64"), ElementsAre(0.1, 0.2, 0.3));
  EXPECT_THAT(numbers("empty"), ElementsAre());
  EXPECT_THAT(numbers("gr\xc3\xb6\xc3\x9f"
                      "e"),
              ElementsAre(2.0));
  EXPECT_EQ(reader.Read("bf16").ShapeText(), "(2, 1)");
  EXPECT_EQ(reader.Read("i64").ShapeText(), "()");
  EXPECT_EQ(reader.Read("empty").ShapeText(), "(2, 0)");
  EXPECT_TRUE(reader.Read("f32").View<float>());
  EXPECT_EQ(reader.Names().size(), 16u);
  EXPECT_TRUE(reader.Has("eight"));
  EXPECT_THROW(reader.Read("eight"), Error) << "8-bit floats are listed and not read";
  EXPECT_THAT(testing::ErrorText([&] { reader.Read("f31"); }),
              HasSubstr("all_types.safetensors[f31]: is missing. The file has: bf16, bool"));
}

TEST(SafetensorsReader, RefusesHostileHeaders) {
  const std::string data(24, '\1');
  const std::string a = R"("a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]})";
  const auto entry = [](const std::string& rest) { return "{\"a\":{" + rest + "}}"; };
  const auto floats = [&](const std::string& shape, const std::string& offsets) {
    return entry(R"("dtype":"F32","shape":[)" + shape + R"(],"data_offsets":[)" + offsets + "]");
  };
  const auto two = [&](const std::string& second) { return "{" + a + "," + second + "}"; };
  std::string rank = "6";
  for (int i = 0; i < 40; ++i) rank += ",1";
  const std::pair<std::string, const char*> headers[] = {
      {"{" + a + "}", "16 bytes after the last tensor"},
      {two(R"("b":{"dtype":"F32","shape":[5],"data_offsets":[4,24]})"), "overlaps"},
      {two(R"("b":{"dtype":"F32","shape":[3],"data_offsets":[12,24]})"), "gap"},
      {two(R"("a":{"dtype":"F32","shape":[4],"data_offsets":[8,24]})"), "twice"},
      {floats("7", "0,24"), "does not fit"},
      {floats("7", "0,28"), "cut off"},
      {floats("6", "24,0"), "lies at bytes 24 to 0"},
      {floats("4611686018427387910", "0,24"), "does not fit"},  // 4 times that overflows to 24
      {floats("-6", "0,24"), "negative"},
      {floats("6.0", "0,24"), "fraction"},
      {floats("6", "0,24,1"), "more than two offsets"},
      {floats("[6]", "0,24"), "a list"},
      {floats(rank, "0,24"), "more than 32"},
      {entry(R"("dtype":"F32","shape":[6])"), "missing"},
      {entry(R"("dtype":"F32","shape":[6],"shape":[6],"data_offsets":[0,24])"), "a field twice"},
      {entry(R"("dtype":"F32","shape":[6],"data_offsets":[0,24],"run":"me")"),
       "unknown field in its header: 'run'"},
      {entry(R"("dtype":5,"shape":[6],"data_offsets":[0,24])"), "a number"},
      {R"({"a":{"dtype":"F32","shape":{}}})", "an object"},
      {R"({"__metadata__":{"k":1}})", "a number"},
      {R"({"__metadata__":{"k":"1","k":"2"}})", "twice"},
      {R"({"__metadata__":{},"__metadata__":{}})", "two metadata"},
      {R"({"a":null})", "null"},
      {"[]", "'{'"},
      {"{\"a\":", "no JSON"},
      {"{} {}", "no JSON"},
      {"{\"a\":{\"shape\":" + std::string(100'000, '['), "a list"}};
  for (const auto& [header, message] : headers) {
    EXPECT_THAT(Refusal(FileOf(header, data)), HasSubstr(message)) << header.substr(0, 100);
  }

  EXPECT_THAT(Refusal("short"), HasSubstr("cut off"));
  EXPECT_THAT(Refusal(LittleEndian(UINT64_MAX, 8) + "{}"), HasSubstr("a header of"));
  EXPECT_THAT(Refusal(LittleEndian(3, 8) + "{}"), HasSubstr("a header of 3 bytes"));
  EXPECT_THAT(Refusal(FileOf("", "")), HasSubstr("'{'"));
  EXPECT_EQ(Refusal(FileOf("{}      ", "")), "no error");
}

TEST(SafetensorsReader, EveryTruncationIsAnError) {
  const std::string whole = ReadFile(kFixtures / "safetensors/all_types.safetensors");
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_NE(Refusal(whole.substr(0, length)), "no error") << length;
  }
}

SafetensorsWriter SomeTensors(bool backwards) {
  SafetensorsWriter writer;
  const auto floats = [&] {
    writer.AddFloat32("decoder.weight", {2, 3}, std::vector<float>{0, 1.5f, -2, 3, 4, 5});
    writer.AddFloat32("nothing", {0, 4}, {});
  };
  if (!backwards) floats();
  writer.AddFloat64("mean", {2}, std::vector<double>{0.1, -1e300});
  writer.AddFloat16("half", {3}, std::vector<float>{1.0f, -0.5f, 65504.0f});
  writer.AddInt64("steps", {}, std::vector<std::int64_t>{-7});
  NpyArray mask{'u', 1, false, false, {3}, {}};
  mask.data = {std::byte{0}, std::byte{1}, std::byte{255}};
  writer.Add("mask", mask);
  if (backwards) floats();
  writer.SetMetadata({{"format", "holdfast"}, {"na\xc3\xafve", "yes, \"quoted\"\n"}});
  return writer;
}

TEST(SafetensorsWriter, WhatItWritesComesBack) {
  const TemporaryFolder folder;
  SomeTensors(false).Write(folder / "a.safetensors");
  const SafetensorsReader reader(folder / "a.safetensors");
  EXPECT_THAT(reader.Read("decoder.weight").AsFloats(), ElementsAre(0, 1.5f, -2, 3, 4, 5));
  EXPECT_EQ(reader.Read("decoder.weight").ShapeText(), "(2, 3)");
  EXPECT_THAT(reader.Read("mean").AsDoubles(), ElementsAre(0.1, -1e300));
  EXPECT_THAT(reader.Read("half").AsFloats(), ElementsAre(1.0f, -0.5f, 65504.0f));
  EXPECT_THAT(reader.Read("steps").AsIntegers(), ElementsAre(-7));
  EXPECT_THAT(reader.Read("mask").AsIntegers(), ElementsAre(0, 1, 255));
  EXPECT_EQ(reader.Metadata().at("na\xc3\xafve"), "yes, \"quoted\"\n");
}

TEST(SafetensorsWriter, TheOrderOfAddingChangesNoByte) {
  const TemporaryFolder folder;
  SomeTensors(false).Write(folder / "a.safetensors");
  SomeTensors(true).Write(folder / "b.safetensors");
  EXPECT_EQ(ReadFile(folder / "a.safetensors"), ReadFile(folder / "b.safetensors"));
}

TEST(SafetensorsWriter, PythonReadsItByTheFormatsDefinition) {
  if (std::system("/usr/bin/python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "no python3 here";
  const TemporaryFolder folder;
  SomeTensors(false).Write(folder / "a.safetensors");
  EXPECT_EQ(std::system(("/usr/bin/python3 '" + (kFixtures / "make_safetensors.py").string() +
                         "' --check '" + (folder / "a.safetensors").string() + "'")
                            .c_str()),
            0);
}

TEST(SafetensorsWriter, RefusesWhatTheFormatCannotHold) {
  SafetensorsWriter writer;
  const std::vector<float> three{1, 2, 3};
  EXPECT_THROW(writer.AddFloat32("a", {2}, three), Error);
  EXPECT_THROW(writer.AddFloat32("__metadata__", {3}, three), Error);
  EXPECT_THROW(writer.AddFloat32("", {3}, three), Error);
  EXPECT_THROW(writer.AddFloat16("a", {1}, std::vector<float>{65520.0f}), Error);
  EXPECT_THROW(writer.Add("a", NpyArray{'U', 4, false, false, {}, std::vector<std::byte>(4)}),
               Error);
  EXPECT_THROW(writer.Add("a", NpyArray{'f', 4, true, false, {}, std::vector<std::byte>(4)}),
               Error);
  const TemporaryFolder folder;
  writer.SetMetadata({{"bad", "\xff"}});
  EXPECT_THROW(writer.Write(folder / "a.safetensors"), Error);
  SafetensorsWriter().Write(folder / "empty.safetensors");
  EXPECT_THROW(SafetensorsWriter().Write(folder / "empty.safetensors/a.safetensors"), Error);
  EXPECT_TRUE(SafetensorsReader(folder / "empty.safetensors").Names().empty());
}

RC_GTEST_PROP(SafetensorsRoundTrip, AnyNumbersComeBack,
              (const std::vector<float>& floats, const std::vector<double>& doubles)) {
  const TemporaryFolder folder;
  SafetensorsWriter writer;
  writer.AddFloat32("f", {floats.size()}, floats);
  writer.AddFloat64("d", {doubles.size(), 1}, doubles);
  writer.Write(folder / "x.safetensors");
  const SafetensorsReader reader(folder / "x.safetensors");
  RC_ASSERT(reader.Read("f").AsFloats() == floats);
  RC_ASSERT(reader.Read("d").AsDoubles() == doubles);
}

}  // namespace
}  // namespace holdfast
