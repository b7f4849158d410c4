// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/torch_archive.h"

#include <cstdlib>
#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/io/container/atomic_file.h"
#include "geometry/io/pickle/data_file.h"
#include "tests/support/error_text.h"
#include "tests/support/peak_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/zip_bytes.h"

namespace holdfast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

const std::filesystem::path kFixtures = HOLDFAST_SOURCE_DIR "/tests/fixtures/torch";

std::vector<double> TorchNumbers(const DataValue& value) { return value.Array().AsDoubles(); }

// The error that reading all of a file ends in.
std::string Refusal(const std::string& bytes) {
  return testing::ErrorText([&] {
    const DataFile file(std::as_bytes(std::span(bytes)), "file.pt");
    for (const std::string& name : file.Names()) TorchNumbers(file[name]);
  });
}

std::string Refusal(const std::filesystem::path& path) { return Refusal(ReadFile(path)); }

// The same value in the forms torch has had, and packed by others.
class EveryForm : public ::testing::TestWithParam<const char*> {
 protected:
  DataFile Open(const std::string& stem) const {
    return DataFile(kFixtures / (stem + GetParam() + ".pt"));
  }
};

INSTANTIATE_TEST_SUITE_P(Torch, EveryForm, ::testing::Values("", "_legacy"));

TEST_P(EveryForm, HoldsEveryType) {
  const DataFile file = Open("dtypes");
  for (const char* name : {"float64", "float32", "float16", "bfloat16"}) {
    EXPECT_THAT(TorchNumbers(file[name]), ElementsAre(0, 1, 2, 100, 1.5, 0.25)) << name;
  }
  for (const char* name : {"int64", "int32", "int16", "int8", "uint8"}) {
    EXPECT_THAT(file[name].Array().AsIntegers(), ElementsAre(0, 1, 2, 100, 1, 0)) << name;
  }
  EXPECT_THAT(TorchNumbers(file["bool"]), ElementsAre(0, 1, 1, 1, 1, 1));
  EXPECT_EQ(file["int8"].Array().ShapeText(), "(2, 3)");
  EXPECT_EQ(file["float16"].Array().array.item_size, 2u);
}

TEST_P(EveryForm, HoldsStateDicts) {
  const DataFile file = Open("network");
  const DataValue state = file["state_dict"];
  EXPECT_THAT(state.Names(),
              ElementsAre("0.weight", "0.bias", "1.weight", "1.bias", "1.running_mean",
                          "1.running_var", "1.num_batches_tracked"));
  EXPECT_THAT(TorchNumbers(state["0.weight"]), ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(TorchNumbers(state["1.running_var"]), ElementsAre(1, 1));
  EXPECT_EQ(state["1.num_batches_tracked"].Integer(), 0);
  EXPECT_THAT(TorchNumbers(file["parameter"]), ElementsAre(1, 1));
  EXPECT_EQ(file["epoch"].Integer(), 7);
  EXPECT_EQ(file["loss"].Number(), 0.125);
  EXPECT_EQ(file["name"].Text(), "arms");
  EXPECT_EQ(file["best"].Kind(), DataKind::kNone);
  EXPECT_EQ(file["done"].Kind(), DataKind::kBool);
  EXPECT_EQ(file["history"][2].Text(), "three");
  EXPECT_THAT(TorchNumbers(file["size"]), ElementsAre(3, 2));
  EXPECT_THAT(file["ordered"].Names(), ElementsAre("b", "a"));
}

TEST_P(EveryForm, ATensorAloneIsTheFilesValue) {
  const DataFile file = Open("tensor");
  EXPECT_TRUE(file.Names().empty());
  EXPECT_THAT(TorchNumbers(file.Root()), ElementsAre(0, 1, 2, 3, 4, 5));
}

TEST_P(EveryForm, NeverBuildsAModule) {
  EXPECT_THAT(Refusal(kFixtures / (std::string("module") + GetParam() + ".pt")),
              HasSubstr("torch.nn.modules.linear.Linear"));
}

class EveryPacking : public EveryForm {};

INSTANTIATE_TEST_SUITE_P(Torch, EveryPacking,
                         ::testing::Values("", "_legacy", "_deflated", "_zip64", "_big_endian"));

TEST_P(EveryPacking, KeepsOffsetsAndStridesOfSharedStorages) {
  const DataFile file = Open("views");
  EXPECT_EQ(TorchNumbers(file["base"]).size(), 24u);
  EXPECT_THAT(TorchNumbers(file["row"]), ElementsAre(6, 7, 8, 9, 10, 11));
  EXPECT_THAT(TorchNumbers(file["column"]), ElementsAre(2, 8, 14, 20));
  EXPECT_THAT(TorchNumbers(file["every_third"]), ElementsAre(1, 4, 7, 10, 13, 16, 19, 22));
  EXPECT_THAT(TorchNumbers(file["block"]), ElementsAre(8, 9, 10, 14, 15, 16));
  EXPECT_EQ(file["expanded"].Array().ShapeText(), "(4, 3)");
  EXPECT_THAT(TorchNumbers(file["expanded"]), ElementsAre(1, 2, 3, 1, 2, 3, 1, 2, 3, 1, 2, 3));
  EXPECT_THAT(TorchNumbers(file["scalar"]), ElementsAre(2.5));
  EXPECT_EQ(file["empty"].Array().ShapeText(), "(0, 3)");
  const std::vector<double> transposed = TorchNumbers(file["transposed"]);
  const std::vector<double> cube = TorchNumbers(file["cube"]);
  EXPECT_EQ(file["cube"].Array().ShapeText(), "(4, 2, 3)");
  for (std::size_t i = 0; i < 24; ++i) {
    EXPECT_EQ(transposed[i], static_cast<double>(i % 4 * 6 + i / 4));
    EXPECT_EQ(cube[i], static_cast<double>(i % 6 * 4 + i / 6));
  }
}

TEST(TorchArchive, ReadsPicklesOfLaterProtocols) {
  EXPECT_THAT(TorchNumbers(DataFile(kFixtures / "protocol4.pt")["x"]), ElementsAre(0, 1, 2));
}

TEST(TorchArchive, IsKnownByItsContentWhateverItsName) {
  EXPECT_EQ(DataFile(kFixtures / "s3_mug_offhand_1.npz").Format(), DataFormat::kTorchZip);
  EXPECT_EQ(DataFile(kFixtures / "s10_mug_drink_1_legacy.npz").Format(), DataFormat::kTorchLegacy);
}

TEST(TorchArchive, TensorsCannotReachOutsideTheirStorage) {
  EXPECT_EQ(Refusal(kFixtures / "lie_none.pt"), "no error");
  EXPECT_EQ(Refusal(kFixtures / "lie_long_storage.pt"), "no error");
  for (const char* lie : {"short_storage", "missing_storage", "stride_outside", "offset_outside",
                          "negative_offset", "negative_stride", "negative_size", "huge_size",
                          "huge_stride", "expanded_bomb", "rank_differs"}) {
    const testing::PeakMemory memory;
    EXPECT_NE(Refusal(kFixtures / (std::string("lie_") + lie + ".pt")), "no error") << lie;
    EXPECT_LT(memory.Growth().value_or(0), std::size_t{64} << 20) << lie;
  }
  EXPECT_THAT(Refusal(kFixtures / "lie_missing_storage.pt"),
              HasSubstr("has no storage 'archive/data/0'"));
  EXPECT_THAT(Refusal(kFixtures / "complex.pt"), HasSubstr("complex"));
}

TEST(TorchArchive, EveryTruncationIsAnError) {
  for (const char* name : {"views.pt", "views_legacy.pt", "views_deflated.pt"}) {
    const std::string whole = ReadFile(kFixtures / name);
    for (std::size_t length = 0; length < whole.size(); ++length) {
      EXPECT_NE(Refusal(whole.substr(0, length)), "no error") << name << " " << length;
    }
  }
}

TEST(TorchArchive, SaysWhatIsWrongWithOtherArchives) {
  const auto refusal = [&](const std::vector<testing::ZipPart>& parts) {
    return Refusal(testing::ZipBytes(parts));
  };
  const std::string none = "\x80\x02N.";
  EXPECT_EQ(refusal({{.name = "deep/er/data.pkl", .content = none}}), "no error");
  EXPECT_EQ(refusal({{.name = "../../data.pkl", .content = none}}), "no error");
  EXPECT_THAT(refusal({{.name = "a/data.pkl", .content = none},
                       {.name = "a/constants.pkl", .content = none}}),
              HasSubstr("TorchScript"));
  EXPECT_THAT(refusal({{.name = "a/data.pkl", .content = none},
                       {.name = "a/byteorder", .content = "middle"}}),
              HasSubstr("byte order"));
  // Zeros in place of a pickle, packed well.
  EXPECT_THAT(refusal({{.name = "a/data.pkl",
                        .content = std::string(std::size_t{80} << 20, '\0'),
                        .method = 8}}),
              HasSubstr("bytes, more than"));
  EXPECT_THAT(Refusal(std::string(257, 'a') + "ustar" + std::string(250, '\0')),
              HasSubstr("torch before 0.4"));
}

TEST(TorchArchive, ReadsWhatTorchWritesNow) {
  if (std::system("/usr/bin/python3 -c 'import torch' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-torch is not installed; the files it wrote before are tested";
  }
  const TemporaryFolder folder;
  ASSERT_EQ(
      std::system(("/usr/bin/python3 '" HOLDFAST_SOURCE_DIR "/tests/fixtures/make_torch.py' '" +
                   folder.Path().string() + "' --expected")
                      .c_str()),
      0);
  std::size_t compared = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.Path())) {
    const std::string path = entry.path().string();
    const std::string ending = ".expected.npz";
    if (!path.ends_with(ending) || path.find("complex") != std::string::npos) continue;
    if (path.find("module") != std::string::npos) continue;
    const DataFile expected(entry.path());
    const DataFile file(path.substr(0, path.size() - ending.size()));
    for (const std::string& name : expected.Names()) {
      DataValue value = file.Root();
      for (std::size_t at = 0; at < name.size();) {
        const std::size_t end = std::min(name.find('/', at), name.size());
        value = value[name.substr(at, end - at)];
        at = end + 1;
      }
      const NpyMember wanted = expected[name].Array();
      EXPECT_EQ(value.Array().ShapeText(), wanted.ShapeText()) << path << name;
      EXPECT_EQ(TorchNumbers(value), wanted.AsDoubles()) << path << name;
      ++compared;
    }
  }
  EXPECT_GT(compared, 100u);
}

}  // namespace
}  // namespace holdfast
