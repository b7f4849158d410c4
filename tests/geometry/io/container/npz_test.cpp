// SPDX-License-Identifier: MIT
#include "geometry/io/container/npz.h"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "geometry/clip/clip.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/npy_header.h"
#include "tests/support/error_text.h"
#include "tests/support/peak_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/zip_bytes.h"

namespace holdfast {
namespace {

using testing::BytesOf;
using ::testing::ElementsAre;
using testing::ErrorText;
using ::testing::HasSubstr;
using testing::NpyBytes;
using testing::PeakMemory;
using testing::TemporaryFolder;
using testing::ZipBytes;
using testing::ZipPart;

std::string Bytes(std::initializer_list<int> values) {
  std::string text;
  for (const int value : values) text.push_back(static_cast<char>(value));
  return text;
}

NpyMember ReadForeign(const std::string& header, const std::string& data) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.npz", std::ios::binary)
      << ZipBytes({{.name = "x.npy", .content = NpyBytes(header, data)}});
  return NpzReader(folder / "a.npz").Read("x");
}

TEST(NpzReader, ReadsArraysLaidOutByHand) {
  EXPECT_THAT(ReadForeign("{'descr': '<i2', 'fortran_order': False, 'shape': (3,), }",
                          Bytes({1, 0, 254, 255, 0, 1}))
                  .AsDoubles(),
              ElementsAre(1.0, -2.0, 256.0));
  EXPECT_THAT(ReadForeign("{'descr': '>u4', 'fortran_order': False, 'shape': (2,), }",
                          Bytes({0, 0, 1, 0, 255, 255, 255, 255}))
                  .AsIntegers(),
              ElementsAre(256, 4294967295));
  EXPECT_THAT(
      ReadForeign("{'descr': '|b1', 'fortran_order': False, 'shape': (2,), }", Bytes({1, 0}))
          .AsDoubles(),
      ElementsAre(1.0, 0.0));
  // (2, 3) in Fortran order: stored by columns.
  EXPECT_THAT(ReadForeign("{'descr': '|u1', 'fortran_order': True, 'shape': (2, 3), }",
                          Bytes({1, 4, 2, 5, 3, 6}))
                  .AsDoubles(),
              ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_EQ(ReadForeign("{'descr': '<U3', 'fortran_order': False, 'shape': (), }",
                        Bytes({'o', 0, 0, 0, 0xe9, 0, 0, 0, 0, 0, 0, 0}))
                .AsText(),
            "o\xc3\xa9");
  EXPECT_EQ(ReadForeign("{'descr': '|S4', 'fortran_order': False, 'shape': (), }",
                        std::string("mug\0", 4))
                .AsText(),
            "mug");
  // Header entries in another order, Python 2 long integers.
  EXPECT_THAT(ReadForeign("{\"shape\": (1L,), \"fortran_order\": False, \"descr\": \"<f8\"}",
                          Bytes({0, 0, 0, 0, 0, 0, 0xf0, 0x3f}))
                  .AsDoubles(),
              ElementsAre(1.0));
}

TEST(NpzReader, RefusesWhatItCannotHold) {
  const auto refused = [](const std::string& header, const char* message) {
    EXPECT_THAT(ErrorText([&] { ReadForeign(header, std::string(8, '\0')); }), HasSubstr(message))
        << header;
  };
  const auto with_type = [](const std::string& type, const std::string& shape) {
    return "{'descr': " + type + ", 'fortran_order': False, 'shape': " + shape + ", }";
  };
  refused(with_type("'|O'", "()"), "Python objects");
  refused(with_type("[('a', '<f8')]", "(1,)"), "structured dtype");
  refused(with_type("'<c8'", "(1,)"), "not a real number");
  refused(with_type("'<f8'", "(9,)"), "does not fit");
  refused(with_type("'<f8'", "(99999999999, 99999999999)"), "does not fit");
  refused("{'descr': '<f8', 'fortran_order': __import__('os'), 'shape': (1,), }",
          "True or False expected");
  refused("{'descr': '<f8', 'shape': (1,), }", "entry is missing");
  refused("nonsense", "malformed");
}

TEST(NpzReader, EveryTruncationIsAnErrorAndNeverACrash) {
  const TemporaryFolder folder;
  NpzWriter writer;
  writer.AddFloat64("a", {2, 2}, {1, 2, 3, 4});
  writer.AddText("b", "text");
  writer.Write(folder / "whole.npz");
  const std::string whole = ReadFile(folder / "whole.npz");
  for (std::size_t length = 0; length < whole.size(); ++length) {
    std::ofstream(folder / "cut.npz", std::ios::binary | std::ios::trunc)
        << whole.substr(0, length);
    EXPECT_THROW(
        {
          const NpzReader reader(folder / "cut.npz");
          reader.Read("a");
          reader.Read("b");
        },
        Error)
        << length;
  }
}

TEST(NpzReader, EveryFlippedByteIsAnErrorOrTheSameNumbers) {
  const TemporaryFolder folder;
  NpzWriter writer;
  writer.AddFloat64("a", {3}, {1.5, -2.25, 1e300});
  writer.Write(folder / "whole.npz");
  const std::string whole = ReadFile(folder / "whole.npz");
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string bad = whole;
    bad[i] = static_cast<char>(bad[i] ^ 0x55);
    std::ofstream(folder / "bad.npz", std::ios::binary | std::ios::trunc) << bad;
    try {
      EXPECT_THAT(NpzReader(folder / "bad.npz").Read("a").AsDoubles(),
                  ElementsAre(1.5, -2.25, 1e300))
          << i;
    } catch (const Error&) {
    }
  }
}

const char* const kOneFloat = "{'descr': '<f4', 'fortran_order': False, 'shape': (1,), }";

std::string FloatArray(float value) { return NpyBytes(kOneFloat, BytesOf<float>({value})); }

NpzReader ReaderOf(const std::string& bytes) {
  return NpzReader(std::as_bytes(std::span(bytes)), "a.npz");
}

// What reading x from an archive of these members throws.
std::string Refusal(const std::vector<ZipPart>& parts) {
  return ErrorText([bytes = ZipBytes(parts)] { ReaderOf(bytes).Read("x"); });
}

TEST(NpzReader, ReadsMembersHoweverTheyArePacked) {
  const std::string content = FloatArray(1.5f);
  for (const int method : {0, 8}) {
    for (const bool zip64 : {false, true}) {
      for (const char* prefix : {"", "#!/bin/sh begins with something else"}) {
        const std::string bytes = ZipBytes(
            {{.name = "x.npy", .content = content, .method = method, .zip64 = zip64}}, prefix);
        EXPECT_THAT(ReaderOf(bytes).Read("x").AsFloats(), ElementsAre(1.5f))
            << method << zip64 << prefix;
      }
    }
  }
}

TEST(NpzReader, ReadsMembersWhoseNamesLackTheEnding) {
  const std::string bytes = ZipBytes({{.name = "x", .content = FloatArray(1.0f)},
                                      {.name = "y", .content = FloatArray(2.0f)},
                                      {.name = "y.npy", .content = FloatArray(3.0f)},
                                      {.name = "folder/", .content = ""},
                                      {.name = "../../up.npy", .content = FloatArray(4.0f)},
                                      {.name = "/root.npy", .content = FloatArray(5.0f)}});
  const NpzReader reader = ReaderOf(bytes);
  EXPECT_THAT(reader.Keys(), ElementsAre("x", "y", "y", "../../up", "/root"));
  EXPECT_THAT(reader.Read("x").AsFloats(), ElementsAre(1.0f));
  EXPECT_THAT(reader.Read("y").AsFloats(), ElementsAre(3.0f)) << "numpy's name goes first";
  EXPECT_THAT(reader.Read("../../up").AsFloats(), ElementsAre(4.0f));
  EXPECT_THAT(reader.Read("/root").AsFloats(), ElementsAre(5.0f));
  EXPECT_FALSE(reader.Has("folder/"));
  EXPECT_FALSE(reader.Has("z"));
}

TEST(NpzReader, SaysWhyAMemberIsNotRead) {
  const std::string content = FloatArray(1.0f);
  const ZipPart sound{.name = "x.npy", .content = content};
  EXPECT_THAT(Refusal({sound, {.name = "x.npy", .content = FloatArray(2.0f)}}),
              HasSubstr("a.npz[x]: is in the archive twice ('x.npy')"));
  EXPECT_THAT(Refusal({}), HasSubstr("is missing"));
  const std::pair<ZipPart, const char*> faults[] = {
      {{.name = "x.npy", .content = content, .flags = 1}, "is encrypted"},
      {{.name = "x.npy", .content = content, .method = 12}, "is packed by method 12"},
      {{.name = "x.npy", .content = content, .checksum = 7}, "checksum"},
      {{.name = "x.npy", .content = content, .size = content.size() + 1}, "of another size"},
      {{.name = "x.npy", .content = content, .method = 8, .size = content.size() + 4},
       "more data than needed"},
      {{.name = "x.npy", .content = "no array, but a text"}, "not .npy data"},
      {{.name = "y.npy", .content = content}, "is missing. The file has: y"}};
  for (const auto& [part, message] : faults) EXPECT_THAT(Refusal({part}), HasSubstr(message));
}

TEST(NpzReader, BelievesNoSizeThatItsDataDoNotBear) {
  const std::string giant = "{'descr': '<f4', 'fortran_order': False, 'shape': (4294967296,), }";
  const std::string content = NpyBytes(giant, "four");
  EXPECT_THAT(Refusal({{.name = "x.npy", .content = content}}), HasSubstr("does not fit"));
  EXPECT_THAT(Refusal({{.name = "x.npy",
                        .content = content,
                        .method = 8,
                        .zip64 = true,
                        .size = content.size() + (std::uint64_t{1} << 34)}}),
              HasSubstr("claim to be"));
  // A real bomb: 288 MB of zeros in one.
  const std::string zeros =
      NpyBytes("{'descr': '|u1', 'fortran_order': False, 'shape': (301989888,), }", "");
  std::string bomb = zeros + std::string(std::size_t{288} << 20, '\0');
  const std::string packed = ZipBytes({{.name = "x.npy", .content = std::move(bomb), .method = 8}});
  ASSERT_LT(packed.size(), std::size_t{2} << 20);
  const PeakMemory reading;
  EXPECT_THAT(ErrorText([&] { ReaderOf(packed).Read("x"); }),
              HasSubstr("save it without compression"));
  EXPECT_LT(reading.Growth().value_or(0), std::size_t{32} << 20);
  // Empty texts take no bytes, however many: the shape alone is refused.
  EXPECT_THAT(ReadForeign("{'descr': '<U0', 'fortran_order': False, 'shape': (3,), }", "")
                  .array.NumElements(),
              3);
  EXPECT_THROW(
      ReadForeign("{'descr': '<U0', 'fortran_order': False, 'shape': (9999999999,), }", ""), Error);
}

TEST(NpzReader, AHundredThousandMembersAreOpenedAtOnce) {
  std::vector<ZipPart> parts(100'000);
  for (std::size_t i = 0; i < parts.size(); ++i) parts[i].name = std::to_string(i) + ".npy";
  parts[77'777].content = FloatArray(7.0f);
  const std::string bytes = ZipBytes(parts);
  const auto begin = std::chrono::steady_clock::now();
  const NpzReader reader = ReaderOf(bytes);
  EXPECT_EQ(reader.Keys().size(), parts.size());
  EXPECT_THAT(reader.Read("77777").AsFloats(), ElementsAre(7.0f));
  EXPECT_THROW(reader.Read("absent"), Error);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
}

TEST(NpyMember, ShowsItsNumbersInPlaceWhereTheTypeIsTheirs) {
  const NpyMember floats = ReadForeign(
      "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 1), }", BytesOf<float>({1.0f, 2.0f}));
  const auto view = floats.View<float>();
  ASSERT_TRUE(view);
  EXPECT_THAT(*view, ElementsAre(1.0f, 2.0f));
  EXPECT_EQ(static_cast<const void*>(view->data()), floats.array.data.data());
  EXPECT_FALSE(floats.View<double>());
  EXPECT_FALSE(floats.View<std::int32_t>());
  EXPECT_FALSE(ReadForeign("{'descr': '>f4', 'fortran_order': False, 'shape': (1,), }", "four")
                   .View<float>());
  EXPECT_FALSE(ReadForeign("{'descr': '<f4', 'fortran_order': True, 'shape': (1, 2), }",
                           BytesOf<float>({1.0f, 2.0f}))
                   .View<float>());
  EXPECT_TRUE(ReadForeign("{'descr': '>u1', 'fortran_order': True, 'shape': (2,), }", "ab")
                  .View<std::uint8_t>());
}

TEST(NpzReader, ReadsALargeMemberWithoutASecondCopy) {
  constexpr std::size_t kBytes = std::size_t{64} << 20;
  const TemporaryFolder folder;
  {
    std::string content =
        NpyBytes("{'descr': '<f4', 'fortran_order': False, 'shape': (4096, 4096), }", "");
    const std::size_t begin = content.size();
    content.resize(begin + kBytes);
    for (std::size_t i = 0; i < kBytes / 4; ++i) {
      const auto value = static_cast<float>(i);
      std::memcpy(content.data() + begin + 4 * i, &value, 4);
    }
    std::ofstream(folder / "large.npz", std::ios::binary)
        << ZipBytes({{.name = "x.npy", .content = std::move(content)}});
  }
  const PeakMemory memory;
  const NpyMember member = NpzReader(folder / "large.npz").Read("x");
  const auto values = member.View<float>();
  ASSERT_TRUE(values);
  EXPECT_EQ((*values)[4096 * 4096 - 1], 4096.0f * 4096.0f - 1.0f);
  const auto growth = memory.Growth();
  if (!growth) GTEST_SKIP() << "the peak of memory cannot be read here";
  EXPECT_LT(*growth, kBytes + kBytes / 2);
}

TEST(NpzWriter, NumpyReadsWhatWeWrite) {
  if (std::system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-numpy is not installed";
  }
  const TemporaryFolder folder;
  NpzWriter writer;
  writer.AddFloat64("d", {2, 3}, {0, 1, 2, 3, 4, 5});
  writer.AddFloat32("s", {1}, {0.5f});
  writer.AddFloat16("h", {3}, {1.0f, -0.333251953125f, 65504.0f});
  writer.AddInt64("i", {}, {-7});
  writer.AddText("t", "m\xc3\xbcg");
  writer.Write(folder / "ours.npz");
  const std::string script =
      "import numpy as np; f = np.load('" + (folder / "ours.npz").string() +
      "'); assert f['d'].tolist() == [[0,1,2],[3,4,5]] and f['d'].dtype == np.float64; "
      "assert f['s'].tolist() == [0.5] and f['h'].tolist() == [1.0, -0.333251953125, 65504.0]; "
      "assert f['i'] == -7 and str(f['t']) == 'm\\u00fcg'; "
      "np.savez_compressed('" +
      (folder / "theirs.npz").string() +
      "', a=np.asfortranarray(np.arange(6.).reshape(2,3)), b=np.array('abc'), "
      "c=np.arange(3, dtype='>i4'))";
  ASSERT_EQ(std::system(("/usr/bin/python3 -c \"" + script + "\"").c_str()), 0);
  const NpzReader theirs(folder / "theirs.npz");
  EXPECT_THAT(theirs.Read("a").AsDoubles(), ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_EQ(theirs.Read("b").AsText(), "abc");
  EXPECT_THAT(theirs.Read("c").AsIntegers(), ElementsAre(0, 1, 2));
}

TEST(NpzWriter, TheSameArraysGiveTheSameBytes) {
  const TemporaryFolder folder;
  for (const char* name : {"a.npz", "b.npz"}) {
    NpzWriter writer;
    writer.AddFloat64("x", {2}, {1, 2});
    writer.Write(folder / name);
  }
  EXPECT_EQ(ReadFile(folder / "a.npz"), ReadFile(folder / "b.npz"));
}

TEST(HalfPrecision, RoundTripsEveryHalf) {
  for (std::uint32_t half = 0; half < 0x10000; ++half) {
    const float value = HalfToFloat(static_cast<std::uint16_t>(half));
    if (std::isnan(value)) continue;
    EXPECT_EQ(FloatToHalf(value), half);
  }
  // Ties go to even; beyond the largest half is infinity.
  EXPECT_EQ(HalfToFloat(FloatToHalf(1.0f + 0x1p-11f)), 1.0f);
  EXPECT_EQ(HalfToFloat(FloatToHalf(1.0f + 3 * 0x1p-11f)), 1.0f + 2 * 0x1p-10f);
  EXPECT_TRUE(std::isinf(HalfToFloat(FloatToHalf(65520.0f))));
}

RC_GTEST_PROP(NpzRoundTrip, AnyNumbersComeBack, (const std::vector<double>& values)) {
  const TemporaryFolder folder;
  NpzWriter writer;
  writer.AddFloat64("x", {values.size()}, values);
  writer.Write(folder / "x.npz");
  RC_ASSERT(NpzReader(folder / "x.npz").Read("x").AsDoubles() == values);
}

TEST(WriteAtomically, KeepsTheOldFileWhenTheNewOneFails) {
  const TemporaryFolder folder;
  WriteAtomically(folder / "a.txt", std::string_view("old"));
  EXPECT_THROW(WriteAtomically(folder / "a.txt",
                               [](const std::filesystem::path& temporary) {
                                 std::ofstream(temporary) << "half";
                                 throw Error("a", "b", "c");
                               }),
               Error);
  EXPECT_EQ(ReadFile(folder / "a.txt"), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.Path()), {}), 1);
}

// --- clips ---

TEST(Clip, ReadsAmasssConcatenatedPoses) {
  const TemporaryFolder folder;
  NpzWriter writer;
  std::vector<float> poses(2 * 165);
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i] = static_cast<float>(i);
  writer.AddFloat32("poses", {2, 165}, poses);
  writer.AddFloat32("trans", {2, 3}, {0, 1, 2, 3, 4, 5});
  writer.AddFloat64("mocap_framerate", {}, {120.0});
  writer.Write(folder / "amass.npz");
  const Clip clip = ReadClip(folder / "amass.npz");
  EXPECT_EQ(clip.frame_rate, 120.0);
  EXPECT_EQ(clip.pose[1](2, 54), 329.0);
  EXPECT_EQ(clip.trans(1, 1), 4.0);
  EXPECT_FALSE(clip.object);
}

TEST(Clip, ASliceKeepsWhatBelongsToItsFrames) {
  Clip clip;
  clip.trans = Eigen::Matrix3Xd::Random(3, 4);
  for (int t = 0; t < 4; ++t) clip.pose.push_back(JointPose::Random());
  clip.object = ObjectTrack{clip.trans, Eigen::Matrix3Xd::Random(3, 4), "mug", ""};
  clip.holding_hand = {0, 1, 2, 3};
  const Clip part = Slice(clip, 1, 3);
  EXPECT_EQ(part.NumFrames(), 2);
  EXPECT_EQ(part.trans, clip.trans.middleCols(1, 2));
  EXPECT_EQ(part.pose[0], clip.pose[1]);
  EXPECT_EQ(part.object->orient, clip.object->orient.middleCols(1, 2));
  EXPECT_THAT(part.holding_hand, ElementsAre(1, 2));
}

}  // namespace
}  // namespace holdfast
