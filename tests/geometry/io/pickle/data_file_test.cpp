// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/data_file.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/container/safetensors.h"
#include "tests/support/error_text.h"
#include "tests/support/peak_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/zip_bytes.h"

namespace holdfast {
namespace {

using testing::BytesOf;
using ::testing::ElementsAre;
using testing::Gzipped;
using ::testing::HasSubstr;
using testing::NpyBytes;
using testing::PeakMemory;
using testing::TemporaryFolder;
using testing::ZipBytes;
using testing::ZipPart;

// {"x": 7} and [1, 2] by hand, protocols 0 and 2.
const std::string kDictPickle("\x80\x02}U\x01xK\x07s.", 10);
const std::string kListPickle = "(lp0\nI1\naI2\na.";
const char* const kTwoFloats = "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }";
const char* const kObject = "{'descr': '|O', 'fortran_order': False, 'shape': (), }";
const std::string kTwoFloatsNpy = NpyBytes(kTwoFloats, BytesOf<float>({1, 2}));

class DataFileTest : public ::testing::Test {
 protected:
  DataFile Open(const std::string& bytes) {
    // The name tells nothing.
    std::ofstream(Path(), std::ios::binary | std::ios::trunc) << bytes;
    return DataFile(Path());
  }
  std::string Refusal(const std::string& bytes) {
    return testing::ErrorText([&] { Open(bytes).Root(); });
  }
  std::filesystem::path Path() const { return folder_ / "file.dat"; }

  TemporaryFolder folder_;
};

std::vector<double> Numbers(const DataValue& value) { return value.Array().AsDoubles(); }

TEST_F(DataFileTest, TellsFormatsByTheirContent) {
  EXPECT_EQ(Open(kTwoFloatsNpy).Format(), DataFormat::kNpy);
  EXPECT_THAT(Numbers(Open(kTwoFloatsNpy).Root()), ElementsAre(1, 2));
  for (const ZipPart& part : {ZipPart{.name = "x.npy", .content = kTwoFloatsNpy},
                              ZipPart{.name = "x", .content = kTwoFloatsNpy},
                              ZipPart{.name = "x", .content = kTwoFloatsNpy, .method = 8}}) {
    EXPECT_EQ(Open(ZipBytes({part})).Format(), DataFormat::kNpz);
  }
  EXPECT_EQ(Open(kDictPickle).Format(), DataFormat::kPickle);
  EXPECT_EQ(Open(kDictPickle)["x"].Integer(), 7);
  EXPECT_EQ(Open(kListPickle).Format(), DataFormat::kPickle);
  EXPECT_THAT(Numbers(Open(kListPickle).Root()), ElementsAre(1, 2));
  EXPECT_EQ(Open(" \n {\"x\": 1}").Format(), DataFormat::kJson);
  EXPECT_EQ(Open("\xef\xbb\xbf[1]").Format(), DataFormat::kJson);
  const DataFile tensors(HOLDFAST_SOURCE_DIR "/tests/fixtures/safetensors/all_types.safetensors");
  EXPECT_EQ(tensors.Format(), DataFormat::kSafetensors);
  EXPECT_THAT(Numbers(tensors["f32"]), ElementsAre(1, 2, 3, 4.5));
  EXPECT_EQ(tensors.Metadata().at("format"), "pt");
}

TEST_F(DataFileTest, UnpacksGzipOnTheWay) {
  EXPECT_THAT(Numbers(Open(Gzipped(kTwoFloatsNpy)).Root()), ElementsAre(1, 2));
  EXPECT_EQ(Open(Gzipped(kDictPickle))["x"].Integer(), 7);
  EXPECT_EQ(Open(Gzipped("{\"x\": 5}"))["x"].Integer(), 5);
  EXPECT_THAT(Numbers(Open(Gzipped(ZipBytes({{.name = "x.npy", .content = kTwoFloatsNpy}})))["x"]),
              ElementsAre(1, 2));
  EXPECT_EQ(Open(Gzipped("{\"x\":") + Gzipped(" 5}"))["x"].Integer(), 5) << "two in a row";
  const std::string packed = Gzipped("{\"x\": [1, 2, 3, 4, 5, 6, 7, 8, 9]}");
  for (std::size_t length = 0; length < packed.size(); ++length) {
    EXPECT_NE(Refusal(packed.substr(0, length)), "no error") << length;
  }
  EXPECT_THAT(Refusal(Gzipped(std::string(std::size_t{96} << 20, '['))),
              HasSubstr("unpack it first"));
}

TEST_F(DataFileTest, ReadsMembersOfNpzOnDemand) {
  const std::string dict = NpyBytes(kObject, kDictPickle);
  const DataFile file = Open(ZipBytes({{.name = "good.npy", .content = kTwoFloatsNpy},
                                       {.name = "dict.npy", .content = dict, .method = 8},
                                       {.name = "bad.npy", .content = "nothing of use"}}));
  EXPECT_THAT(file.Names(), ElementsAre("good", "dict", "bad"));
  EXPECT_TRUE(file.Has("bad"));
  EXPECT_FALSE(file.Has("worse"));
  EXPECT_FALSE(file.Find("worse"));
  EXPECT_THAT(Numbers(file["good"]), ElementsAre(1, 2));
  EXPECT_EQ(file["dict"]["x"].Integer(), 7);
  EXPECT_EQ(file["dict"]["x"].Where(), Path().string() + "[dict][x]");
  EXPECT_THROW(file["bad"], Error);
  EXPECT_THROW(file["worse"], Error);
  EXPECT_THROW(file.Root(), Error) << "the root has all of them";
}

TEST_F(DataFileTest, TheRootOfAnArchiveHasAllItsMembers) {
  const DataFile file =
      Open(ZipBytes({{.name = "a.npy", .content = kTwoFloatsNpy},
                     {.name = "one.npy", .content = NpyBytes(kObject, kDictPickle)},
                     {.name = "two.npy", .content = NpyBytes(kObject, kListPickle)}}));
  const DataValue root = file.Root();
  EXPECT_EQ(root.Kind(), DataKind::kDict);
  EXPECT_THAT(root.Names(), ElementsAre("a", "one", "two"));
  EXPECT_THAT(Numbers(root["a"]), ElementsAre(1, 2));
  EXPECT_EQ(root["one"]["x"].Integer(), 7);
  EXPECT_THAT(Numbers(root["two"]), ElementsAre(1, 2));
  EXPECT_EQ(root["two"].Where(), Path().string() + "[two]");
}

TEST_F(DataFileTest, ReadsObjectsInANpy) {
  EXPECT_EQ(Open(NpyBytes(kObject, kDictPickle))["x"].Integer(), 7);
  EXPECT_THAT(Refusal(NpyBytes(kObject,
                               "\x80\x02"
                               "cos\nsystem\n(tR.")),
              HasSubstr("os.system"));
}

TEST_F(DataFileTest, ReadsJson) {
  const DataFile file = Open(R"({"pose": [[1, 2.5], [-3, 4e0]], "name": "m\u00fcg", "ok": true,
      "none": null, "big": 18446744073709551615, "deep": {"list": [{"x": 1}]}, "name": "last"})");
  EXPECT_THAT(file.Names(), ElementsAre("pose", "name", "ok", "none", "big", "deep"));
  EXPECT_THAT(Numbers(file["pose"]), ElementsAre(1, 2.5, -3, 4));
  EXPECT_EQ(file["pose"].Array().ShapeText(), "(2, 2)");
  EXPECT_EQ(file["pose"][1][0].Integer(), -3);
  EXPECT_EQ(file["name"].Text(), "last");
  EXPECT_EQ(file["ok"].Kind(), DataKind::kBool);
  EXPECT_EQ(file["none"].Kind(), DataKind::kNone);
  EXPECT_EQ(file["big"].Number(), 0x1p64);
  EXPECT_EQ(file["deep"]["list"][0]["x"].Integer(), 1);
  EXPECT_EQ(file["deep"]["list"][0]["x"].Where(), Path().string() + "[deep][list][0][x]");

  EXPECT_THAT(Refusal("{\"a\": 1,\n \"b\": NaN}"), HasSubstr("is not JSON at line 2, column 7"));
  EXPECT_THAT(Refusal("{\"a\": [1, 2"), HasSubstr("ends within its JSON"));
  EXPECT_THAT(Refusal("{\"a\": 1} trailing"), HasSubstr("is not JSON"));
  EXPECT_THAT(Refusal("{\"a\": \"\xff\"}"), HasSubstr("is not JSON"));
  EXPECT_THAT(Refusal(std::string(1'000'000, '[')), HasSubstr("100 levels"));
  EXPECT_EQ(Refusal(std::string(100, '[') + std::string(100, ']')), "no error");
  std::string many = "[1";
  for (int i = 0; i < 8'000'000; ++i) many += ",1";
  const PeakMemory memory;
  EXPECT_THAT(Refusal(many + "]"), HasSubstr("memory"));
  EXPECT_LT(memory.Growth().value_or(0), 10 * many.size() + (std::size_t{64} << 20));
}

TEST_F(DataFileTest, NamesWhatItDoesNotRead) {
  EXPECT_THAT(Refusal(""), HasSubstr("is empty"));
  EXPECT_THAT(Refusal("\x89HDF\r\n\x1a\n"), HasSubstr("is HDF5"));
  EXPECT_THAT(Refusal("<!DOCTYPE html><html>"), HasSubstr("web page"));
  EXPECT_THAT(Refusal("version https://git-lfs.github.com/spec/v1"), HasSubstr("git-lfs"));
  EXPECT_THAT(Refusal("some text that is nothing"), HasSubstr("not of a supported format"));
  EXPECT_THAT(Refusal(std::string(100, '\0')), HasSubstr("not of a supported format"));
  EXPECT_THAT(Refusal(ZipBytes({{.name = "readme.txt", .content = "hello, world"},
                                {.name = "../../etc/passwd", .content = "root"}})),
              HasSubstr("is a zip archive of neither numpy nor torch. Unpack it first. It has: "
                        "readme.txt, ../../etc/passwd"));
  EXPECT_THROW(DataFile(folder_ / "absent"), Error);
  EXPECT_THROW(DataFile(folder_.Path()), Error);
}

TEST_F(DataFileTest, GivesALargeArrayAwayUncopied) {
  constexpr std::size_t kBytes = std::size_t{64} << 20;
  const std::string header =
      NpyBytes("{'descr': '<f8', 'fortran_order': False, 'shape': (8192, 1024), }", "");
  {
    std::string content = header;
    content.resize(header.size() + kBytes, '\1');
    std::ofstream(folder_ / "large.npz", std::ios::binary)
        << ZipBytes({{.name = "x.npy", .content = content}});
    SafetensorsWriter writer;
    writer.AddFloat64("x", {kBytes / 8}, std::vector<double>(kBytes / 8, 1.0));
    writer.Write(folder_ / "large.safetensors");
    std::ofstream(folder_ / "large.npy", std::ios::binary) << content;
  }
  for (const char* name : {"large.npz", "large.safetensors", "large.npy"}) {
    const PeakMemory memory;
    const DataFile file(folder_ / name);
    const NpyMember member = (file.Format() == DataFormat::kNpy ? file.Root() : file["x"]).Array();
    ASSERT_TRUE(member.View<double>()) << name;
    const auto growth = memory.Growth();
    if (!growth) GTEST_SKIP() << "the peak of memory cannot be read here";
    EXPECT_LT(*growth, kBytes + kBytes / 2) << name;
  }
}

}  // namespace
}  // namespace holdfast
