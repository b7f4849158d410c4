// SPDX-License-Identifier: MIT
// Reads what numpy, scipy and Python wrote (tests/fixtures/make_pickles.py), in every protocol.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "geometry/io/container/npz.h"
#include "tests/support/error_text.h"
#include "tests/support/pickle_files.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::ElementsAre;
using testing::ErrorText;
using ::testing::HasSubstr;
using testing::PickleFixtures;
using testing::ReadPickleFile;
namespace fs = std::filesystem;

class EveryProtocol : public ::testing::TestWithParam<int> {
 protected:
  DataValue Read(std::string_view name) const {
    return ReadPickleFile(PickleFixtures() / fmt::format("{}_p{}.pkl", name, GetParam()));
  }
};
INSTANTIATE_TEST_SUITE_P(Pickle, EveryProtocol, ::testing::Range(0, 6));

// Thirteen types and texts, in C and Fortran order, little- and big-endian: 1 ... 6 in two rows.
void ExpectSmallArrays(const DataValue& file) {
  ASSERT_EQ(file.Kind(), DataKind::kDict);
  EXPECT_EQ(file.Names().size(), 56u);
  for (const std::string& name : file.Names()) {
    SCOPED_TRACE(name);
    const NpyMember member = file[name].Array();
    EXPECT_THAT(member.array.shape, ElementsAre(2u, 3u));
    if (name[0] == 'U' || name[0] == 'S') {
      EXPECT_EQ(member.array.kind, name[0]);
      EXPECT_FALSE(file[name].HoldsNumbers());
    } else if (name[0] == 'b') {
      EXPECT_THAT(member.AsDoubles(), ElementsAre(1, 0, 1, 0, 1, 0));
    } else {
      EXPECT_THAT(member.AsDoubles(), ElementsAre(1, 2, 3, 4, 5, 6));
      EXPECT_EQ(fmt::format("{}{}", member.array.kind, member.array.item_size), name.substr(0, 2));
    }
    EXPECT_EQ(member.array.fortran_order, name[2] == 'F');
    if (name[1] != '1' && name[0] != 'S') {
      EXPECT_EQ(member.array.big_endian, name[3] == '>');
    }
  }
}

TEST_P(EveryProtocol, ArraysOfEveryTypeOrderAndByteOrder) { ExpectSmallArrays(Read("arrays")); }

TEST(Pickle, ArraysUnderTheNamesOfNumpy2) {
  for (const int protocol : {2, 4, 5}) {
    ExpectSmallArrays(
        ReadPickleFile(PickleFixtures() / fmt::format("arrays_numpy2_p{}.pkl", protocol)));
  }
}

TEST(Pickle, ArraysWhoseBytesAreTextsOfPython2) {
  for (const int protocol : {0, 1, 2}) {
    ExpectSmallArrays(
        ReadPickleFile(PickleFixtures() / fmt::format("arrays_python2_p{}.pkl", protocol)));
  }
}

TEST_P(EveryProtocol, NumbersOfEverySize) {
  const DataValue file = Read("plain");
  EXPECT_EQ(file["none"].Kind(), DataKind::kNone);
  EXPECT_EQ(file["true"].Kind(), DataKind::kBool);
  EXPECT_EQ(file["true"].Number(), 1);
  EXPECT_EQ(file["false"].Describe(), "False");
  const std::int64_t two31 = std::int64_t{1} << 31;
  EXPECT_THAT(file["integers"].Array().AsIntegers(),
              ElementsAre(0, 1, 255, 256, 65535, 65536, -1, -129, two31 - 1, two31, -two31,
                          -two31 - 1, INT64_MAX, INT64_MIN));
  EXPECT_EQ(file["integers"][0].Kind(), DataKind::kInteger);
  const std::vector<double> beyond = file["beyond"].Array().AsDoubles();
  EXPECT_EQ(beyond[0], 0x1p63);
  EXPECT_EQ(beyond[1], -0x1p63);
  EXPECT_DOUBLE_EQ(beyond[2], 1e30);
  EXPECT_DOUBLE_EQ(beyond[3], -1e30);
  EXPECT_TRUE(std::isinf(beyond[4]));
  const double infinity = HUGE_VAL;
  EXPECT_THAT(file["reals"].Array().AsDoubles(),
              ElementsAre(0.0, -0.0, 1.5, 1e300, -1e-300, infinity, -infinity, 0.1));
  EXPECT_TRUE(std::signbit(file["reals"][1].Number()));
  EXPECT_TRUE(std::isnan(file["nan"].Number()));
}

TEST_P(EveryProtocol, TextsAndBytes) {
  const DataValue file = Read("plain");
  const DataValue texts = file["texts"];
  ASSERT_EQ(texts.Size(), 5u);
  EXPECT_EQ(texts[0].Text(), "");
  EXPECT_EQ(texts[1].Text(), "plain");
  EXPECT_EQ(texts[2].Text(), "Größe €");
  const std::string odd("\U0001d11e \\ \\u0041 'q' \"d\"\n\r\t\0end", 28);
  EXPECT_EQ(texts[3].Text(), odd);
  EXPECT_EQ(texts[4].Text(), std::string(300, 'x'));
  EXPECT_EQ(texts[4].Kind(), DataKind::kText);
  const DataValue bytes = file["bytes"];
  EXPECT_EQ(bytes[0].Text(), "");
  EXPECT_EQ(bytes[1].Kind(), DataKind::kBytes);
  std::string all;
  for (int i = 0; i < 256; ++i) all.push_back(static_cast<char>(i));
  EXPECT_EQ(bytes[2].Text(), all);
  EXPECT_EQ(bytes[3].Text().size(), 400u);
  EXPECT_EQ(file["bytearray"].Text(), std::string("\x00\xff\x80", 3));
  EXPECT_EQ(file["path"].Text(), "/data/smplx/model.npz");
}

TEST_P(EveryProtocol, Containers) {
  const DataValue file = Read("plain");
  for (std::size_t n = 0; n < 5; ++n) EXPECT_EQ(file["tuples"][n].Size(), n);
  EXPECT_EQ(file["set"][0].Integer(), 7);
  EXPECT_EQ(file["frozenset"][0].Integer(), 8);
  EXPECT_THAT(file["dict"].Names(), ElementsAre("a", "2", "bytes"));
  EXPECT_EQ(file["dict"]["2"].Text(), "two");
  EXPECT_THAT(file["ordered"].Names(), ElementsAre("z", "a"));
  EXPECT_EQ(file["default"]["k"].Size(), 1u);
  EXPECT_EQ(file["counter"]["a"].Integer(), 2);
  const DataValue settings = file["namespace"];
  EXPECT_EQ(settings.Kind(), DataKind::kObject);
  EXPECT_EQ(settings.Describe(), "argparse.Namespace");
  EXPECT_EQ(settings["epochs"].Integer(), 3);
  EXPECT_EQ(settings["inner"]["lr"].Number(), 0.5);
  EXPECT_EQ(settings["inner"]["lr"].Where(), settings.Where() + "[inner][lr]");
  EXPECT_EQ(file["type"].Describe(), "the class numpy.float32");
  const DataValue loop = file["loop"];
  EXPECT_EQ(loop[1][1][1][0].Integer(), 1);
}

TEST_P(EveryProtocol, NumpyScalars) {
  const DataValue scalars = Read("plain")["scalars"];
  EXPECT_EQ(scalars["f4"].Number(), 1.5);
  EXPECT_EQ(scalars["f2"].Number(), 0.5);
  EXPECT_EQ(scalars["f8"].Number(), -2.5);
  EXPECT_EQ(scalars["i8"].Integer(), -7);
  EXPECT_EQ(scalars["u1"].Integer(), 200);
  EXPECT_EQ(scalars["b"].Integer(), 1);
  EXPECT_EQ(scalars["U"].Text(), "Größe");
  EXPECT_EQ(scalars["U"].Kind(), DataKind::kText);
  EXPECT_EQ(scalars["S"].Text(), "raw");
}

TEST_P(EveryProtocol, ArraysOfObjectsAreLists) {
  const DataValue file = Read("plain");
  const DataValue objects = file["objects"];
  ASSERT_EQ(objects.Size(), 4u);
  EXPECT_EQ(objects[0].Text(), "one");
  EXPECT_EQ(objects[3][0].Integer(), 3);
  const DataValue grid = file["object_grid"];
  ASSERT_EQ(grid.Size(), 2u);
  EXPECT_EQ(grid[1].Size(), 3u);
  EXPECT_EQ(grid[1][0].Text(), "b");
  EXPECT_THAT(file["empty"].Array().array.shape, ElementsAre(0u, 3u));
  EXPECT_EQ(file["rank0"].Number(), 2.5);
  EXPECT_THAT(file["strided"].Array().AsDoubles(), ElementsAre(3, 2, 1, 0, 11, 10, 9, 8));
  EXPECT_THAT(file["matrix"].Array().AsIntegers(), ElementsAre(1, 2, 3, 4));
}

TEST_P(EveryProtocol, SparseMatrices) {
  const DataValue file = Read("sparse");
  for (const char* name : {"csc", "csr", "single"}) {
    const NpyMember dense = file[name].Array();
    EXPECT_TRUE(file[name].HoldsNumbers());
    EXPECT_THAT(dense.array.shape, ElementsAre(3u, 4u));
    EXPECT_THAT(dense.AsDoubles(), ElementsAre(0, 1.5, 0, 0, 2, 0, 0, -3, 0, 0, 0, 0)) << name;
  }
  EXPECT_THAT(file["coo"].Array().AsDoubles(), ElementsAre(0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4));
}

TEST_P(EveryProtocol, ModelOfChumpyArrays) {
  const DataValue file = Read("mano");
  const NpyMember mean = file["v_template"].Array();
  EXPECT_THAT(mean.array.shape, ElementsAre(6u, 3u));
  EXPECT_EQ(mean.AsDoubles()[17], 17);
  const NpyMember shapes = file["shapedirs"].Array();  // two of four columns, selected by place
  EXPECT_THAT(shapes.array.shape, ElementsAre(6u, 3u, 2u));
  for (std::size_t row = 0; row < 18; ++row) {
    EXPECT_EQ(shapes.AsDoubles()[2 * row], 4.0 * static_cast<double>(row));
    EXPECT_EQ(shapes.AsDoubles()[2 * row + 1], 4.0 * static_cast<double>(row) + 1);
  }
  EXPECT_THAT(file["posedirs"].Array().array.shape, ElementsAre(6u, 3u, 9u));
  EXPECT_EQ(file["posedirs"].Array().AsDoubles()[161], 161);
  EXPECT_THAT(file["J_regressor"].Array().AsDoubles(),
              ElementsAre(0.5, 0, 0, 0, 0, 0, 0, 0.5, 0, 0, 0, 0));
  EXPECT_EQ(file["weights"].Array().AsDoubles()[3], 1);
  EXPECT_EQ(file["kintree_table"].Array().AsIntegers()[0], 4294967295);
  EXPECT_EQ(file["bs_style"].Text(), "lbs");
  EXPECT_EQ(file["bs_style"].Kind(), DataKind::kText);
  EXPECT_FALSE(file["expression"].HoldsNumbers());
  EXPECT_THAT(
      ErrorText([&] { file["expression"].Array(); }),
      HasSubstr("[expression]: is a chumpy.ch_ops.subtract, which would have to be computed"));
}

TEST(Pickle, BuffersBesideTheFile) {
  EXPECT_THAT(ErrorText([] { ReadPickleFile(PickleFixtures() / "buffers.pkl"); }),
              HasSubstr("needs buffers that lie outside of the file"));
}

TEST(Pickle, OneAfterTheOther) {
  const std::vector<std::byte> bytes = testing::ReadBytes(PickleFixtures() / "two.pkl");
  std::size_t read = 0;
  EXPECT_EQ(ReadPickle({bytes, nullptr}, "two.pkl", {}, &read).Text(), "first");
  EXPECT_EQ(ReadPickle({std::span(bytes).subspan(read), nullptr}, "two.pkl")[0].Integer(), 2);
}

// What torch.save writes: two views of the storage "7" and one of "8".
constexpr std::string_view kTensors =
    "ctorch._utils\n_rebuild_tensor_v2\nq\x01"
    "0(dVrows\nh\x01((Vstorage\nctorch\nFloatStorage\nV7\nVcpu\nI6\ntQI0\n(I2\nI3\nt(I3\nI1\nt"
    "I00\nccollections\nOrderedDict\n)RtRsVcolumn\nctorch._utils\n_rebuild_parameter\n(h\x01("
    "(Vstorage\nctorch\nFloatStorage\nV7\nVcpu\nI6\ntQI1\n(I2\nt(I3\ntI01\nNtRI01\nNtRsVlong\n"
    "h\x01((Vstorage\nctorch\nLongStorage\nV8\nVcpu\nI1\ntQI0\n)(tI00\nNtRs.";

TEST(Pickle, TensorsAreViewsOfStoragesThatAreAskedForOnce) {
  std::vector<float> numbers{1, 2, 3, 4, 5, 6};
  std::vector<std::int64_t> one{42};
  std::vector<std::string> asked;
  std::size_t bytes_read = 0;
  PickleOptions options;
  options.storage = [&](const TorchStorageRequest& request) {
    EXPECT_EQ(bytes_read, kTensors.size());
    asked.push_back(fmt::format("{} {}{} x {}", request.key, request.element.kind,
                                request.element.size, request.count));
    return DataBytes{
        request.key == "7" ? std::as_bytes(std::span(numbers)) : std::as_bytes(std::span(one)),
        nullptr};
  };
  const auto pickle = std::as_bytes(std::span(kTensors.data(), kTensors.size()));
  const DataValue file = ReadPickle({pickle, nullptr}, "t.pt", options, &bytes_read);
  EXPECT_THAT(asked, ElementsAre("7 f4 x 6", "8 i8 x 1"));
  EXPECT_THAT(file["rows"].Array().array.shape, ElementsAre(2u, 3u));
  EXPECT_THAT(file["rows"].Array().AsFloats(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(file["column"].Array().AsFloats(), ElementsAre(2, 5));
  EXPECT_EQ(file["long"].Integer(), 42);
  numbers.pop_back();
  EXPECT_THAT(ErrorText([&] {
                ReadPickle({pickle, nullptr}, "t.pt", options);
              }),
              HasSubstr("t.pt: has 20 bytes of torch storage '7' where 6 elements of 4 bytes"));
}

TEST(Pickle, SaysWhatItRefuses) {
  for (const auto& [name, message] : {std::pair{"complex_array", "holds complex numbers"},
                                      {"complex_number", "holds complex numbers"},
                                      {"long_double", "holds numbers longer than 64 bits"},
                                      {"records", "holds records (a structured dtype)"},
                                      {"dates", "holds dates"},
                                      {"function", "asks for 'builtins.print', which is refused"},
                                      {"lil", "asks for 'scipy.sparse._lil.lil_matrix'"},
                                      {"random", "asks for 'numpy.random"}}) {
    const fs::path path = PickleFixtures() / fmt::format("refused_{}.pkl", name);
    EXPECT_THAT(ErrorText([&] { ReadPickleFile(path); }), HasSubstr(message)) << name;
  }
}

TEST(Pickle, IsToldFromOtherFilesByItsBegin) {
  for (const auto& entry : fs::directory_iterator(PickleFixtures())) {
    const bool is_pickle = entry.path().extension() == ".pkl";
    if (!is_pickle && entry.path().extension() != ".npz") continue;
    EXPECT_EQ(LooksLikePickle(testing::ReadBytes(entry.path())), is_pickle) << entry.path();
  }
}

TEST(Pickle, FilesWrittenNowReadAsTheKeptOnes) {
  if (std::system("/usr/bin/python3 -c 'import numpy, scipy' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-numpy and python3-scipy are not installed";
  }
  const testing::TemporaryFolder folder;
  const fs::path script = PickleFixtures().parent_path() / "make_pickles.py";
  ASSERT_EQ(std::system(("/usr/bin/python3 '" + script.string() + "' '" + folder.Path().string() +
                         "' 2>/dev/null")
                            .c_str()),
            0);
  int files = 0;
  for (const auto& entry : fs::directory_iterator(folder.Path())) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("arrays_")) ExpectSmallArrays(ReadPickleFile(entry.path()));
    if (entry.path().extension() != ".pkl" || name.starts_with("refused_") ||
        name.starts_with("buffers")) {
      continue;
    }
    EXPECT_EQ(ReadPickleFile(entry.path()).Names(),
              ReadPickleFile(PickleFixtures() / name).Names());
    ++files;
  }
  EXPECT_EQ(files, 31);
}

}  // namespace
}  // namespace holdfast
