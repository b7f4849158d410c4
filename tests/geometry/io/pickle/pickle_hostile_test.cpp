// SPDX-License-Identifier: MIT
// Pickles written to do harm, and cut ones: each gives an Error (or a value), soon, in bounded
// memory, and never anything else. Changed ones are read by the fuzzers' tests.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ctime>

#include <fmt/format.h>

#include "geometry/error.h"
#include "tests/support/error_text.h"
#include "tests/support/peak_memory.h"
#include "tests/support/pickle_files.h"
#include "tests/support/zip_bytes.h"

namespace holdfast {
namespace {

using ::testing::HasSubstr;
using testing::LittleEndian;
using testing::PickleFixtures;
using testing::ReadPickleText;

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kMeasured = false;  // the sanitizer keeps what is freed, and is slow
#else
constexpr bool kMeasured = true;
#endif

/// What reading gives: the message of the Error, or "no error". Within the bounds on time and
/// memory that hold for every file.
template <typename Run>
std::string Bounded(std::size_t file_bytes, const Run& run) {
  const testing::PeakMemory memory;
  const std::clock_t start = std::clock();
  const std::string outcome = testing::ErrorText(run);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  if (kMeasured) {
    EXPECT_LT(seconds, 2.0) << outcome;
    EXPECT_LT(memory.Growth().value_or(0), 10 * file_bytes + (std::size_t{64} << 20)) << outcome;
  }
  return outcome;
}

std::string Read(std::string_view text) {
  return Bounded(text.size(), [&] { ReadPickleText(text); });
}

std::string ReadNumbers(std::string_view text) {
  return Bounded(text.size(), [&] { ReadPickleText(text).Array(); });
}

std::string Repeat(std::string_view text, std::size_t times) {
  std::string all;
  all.reserve(text.size() * times);
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

TEST(HostilePickle, NoNameOutsideOfTheTableIsLookedUp) {
  const std::string stack_global("\x80\x04\x8c\x02os\x8c\x06system\x93\x8c\x04true\x85R.");
  const std::string dotted(
      "\x80\x04\x8c\x0b"
      "collections"
      "\x8c\x1c"
      "OrderedDict.__init__.im_func"
      "\x93.");
  const std::pair<std::string, std::string> pickles[] = {
      {"cos\nsystem\n(S'true'\ntR.", "asks for 'os.system', which is refused"},
      {stack_global, "asks for 'os.system', which is refused"},
      {"(S'true'\nios\nsystem\n.", "asks for 'os.system', which is refused"},
      {"(cos\nsystem\nS'true'\no.", "asks for 'os.system', which is refused"},
      {"cposix\nsystem\n(S'true'\ntR.", "asks for 'posix.system'"},
      {"c__builtin__\neval\n(S'1'\ntR.", "asks for '__builtin__.eval'"},
      {"cbuiltins\ngetattr\n.", "asks for 'builtins.getattr'"},
      {"csubprocess\nPopen\n.", "asks for 'subprocess.Popen'"},
      {"cnumpy.core.multiarray\nfrombuffer\n.", "asks for 'numpy.core.multiarray.frombuffer'"},
      {"ctorch\nload\n.", "asks for 'torch.load'"},
      {"cscipy.sparse.\ncsc_matrix\n.", "asks for 'scipy.sparse..csc_matrix'"},
      {"c\n\n.", "asks for '.'"},
      {"c\x1b[2J\nx\n.", "asks for '?[2J.x'"},
      {dotted, "asks for 'collections.OrderedDict.__init__.im_func'"},
      {"c" + std::string(100000, 'a') + "\nb\n.", "aaa...."},
  };
  for (const auto& [pickle, message] : pickles) EXPECT_THAT(Read(pickle), HasSubstr(message));
}

TEST(HostilePickle, NamesOfTheTableDoNothingButDescribeData) {
  const std::pair<std::string, std::string> pickles[] = {
      {"I5\n)R.", "calls a value that is neither class nor function"},
      {"}}R.", "calls something without a list of arguments"},
      {"cnumpy\nfloat32\n)R.", "calls 'numpy.float32', which does not represent data"},
      {"ctorch\nFloatStorage\n(I9\ntR.",
       "calls 'torch.FloatStorage', which does not represent data"},
      {"ccollections\nOrderedDict\n(I5\ntR.", "makes a dict from a value that is not a dict"},
      {"ccollections\nOrderedDict\n(((I1\nlltR.", "makes a dict from items that are not pairs"},
      {"c__builtin__\nset\n(I5\ntR.", "makes a list from a value that is not a list"},
      {"c_codecs\nencode\n(Vx\nVrot13\ntR.", "holds bytes encoded as 'rot13'"},
      {"c_codecs\nencode\n(V\\u20ac\nVlatin1\ntR.", "encodes text that does not fit into bytes"},
      {"ccopy_reg\n_reconstructor\n(I1\nI2\nI3\ntR.", "has an instance of unknown form"},
      {"ccopy_reg\n__newobj__\n)R.", "has an instance of unknown form"},
      {"ccopy_reg\n__newobj__\n(ccopy_reg\n__newobj__\ntR.", "does not represent data"},
      {"cargparse\nNamespace\n}b.", "sets fields of a class"},
      {"I5\n}b.", "sets fields of a value that has none"},
      {"ctorch._utils\n_rebuild_tensor_v2\n(I1\nI0\n))tR.", "has a torch tensor without a storage"},
      {"(Vstorage\nctorch\nFloatStorage\nV0\nVcpu\nI4\ntQ.", "is the pickle of a torch file"},
      {"Pfile\n.", "refers to data outside of the pickle"},
      {"\x80\x06.", "of protocol 6, newer than the fifth"},
      {"\x82\x01.", "extension registry, which is refused"},
  };
  for (const auto& [pickle, message] : pickles) EXPECT_THAT(Read(pickle), HasSubstr(message));
}

TEST(HostilePickle, AnnouncedSizesAreNotBelieved) {
  for (const char* opcode : {"\x8d", "\x8e", "\x96", "\x95"}) {
    for (const std::uint64_t size : {std::uint64_t{1} << 63, ~std::uint64_t{0}, std::uint64_t{9}}) {
      EXPECT_THAT(Read(std::string(opcode) + LittleEndian(size, 8) + "abc."),
                  HasSubstr("where 4 are left"));
    }
  }
  for (const char* opcode : {"X", "B", "T", "\x8b"}) {
    EXPECT_THAT(Read(std::string(opcode) + LittleEndian(0x7fffffff, 4) + "abc."),
                HasSubstr("where 4 are left"));
  }
  EXPECT_THAT(Read("\x8b" + LittleEndian(0xffffffff, 4) + "abc."), HasSubstr("negative length"));
  EXPECT_THAT(Read("I" + std::string(1 << 20, '9') + "\n."), HasSubstr("unreadable whole number"));
  EXPECT_EQ(Read("\x8b" + LittleEndian(1 << 20, 4) + std::string(1 << 20, '\x7f') + "."),
            "no error");
}

TEST(HostilePickle, MemoTakesAnyNumber) {
  EXPECT_EQ(Read("]r" + LittleEndian(0xffffffff, 4) + "0j" + LittleEndian(0xffffffff, 4) + "."),
            "no error");
  EXPECT_THAT(Read("j" + LittleEndian(0xffffffff, 4) + "."),
              HasSubstr("asks for value 4294967295"));
  EXPECT_THAT(Read("]p99999999999999999999999\n."), HasSubstr("unreadable memo number"));
  EXPECT_THAT(Read("]p-1\n."), HasSubstr("unreadable memo number"));
  std::string far = "]";
  for (std::uint64_t i = 0; i < 1000000; ++i) far.append("r").append(LittleEndian(i * 4099, 4));
  EXPECT_EQ(Read(far + "."), "no error");
}

TEST(HostilePickle, NestingCostsNoStackAndEnds) {
  constexpr std::size_t kMany = 10000000;
  EXPECT_THAT(Read(std::string(kMany, '(') + "."), HasSubstr("would take more than"));
  EXPECT_THAT(Read(std::string(kMany, '(') + std::string(kMany, 'l') + "."), HasSubstr("x.pkl: "));
  const std::string deep = std::string(50000, '(') + std::string(50000, 'l') + ".";
  EXPECT_THAT(Read(deep), HasSubstr("is nested more than 1000 values deep"));
  EXPECT_THAT(Read(std::string(kMany, ']') + "."), HasSubstr("would take more than"));
  EXPECT_THAT(Read(std::string(kMany, '}') + "."), HasSubstr("would take more than"));
  EXPECT_THAT(Read("]" + std::string(kMany, '\x94') + "."), HasSubstr("no error"));
  EXPECT_THAT(Read("N" + std::string(kMany, '2') + "."), HasSubstr("does not end with one value"));
}

TEST(HostilePickle, LoopsAndSharedValuesAreNoTrap) {
  EXPECT_EQ(Read("]q\x01h\x01"
                 "a."),
            "no error");
  EXPECT_THAT(ReadNumbers("]q\x01h\x01"
                          "a."),
              HasSubstr("is a list that holds itself"));
  EXPECT_THAT(ReadNumbers(std::string(40, '(') + "I7\n" + std::string(40, 'l') + "."),
              HasSubstr("nested more than 32 lists deep"));
  // Each list holds the one before twice, or ten times.
  std::string laughs = "I7\n";
  for (int i = 0; i < 30; ++i)
    laughs +=
        "q\x01"
        "0(h\x01h\x01l";
  EXPECT_EQ(Read(laughs + "."), "no error");
  EXPECT_THAT(ReadNumbers(laughs + "."), HasSubstr("beyond the memory limit"));
  std::string chumpy = "cchumpy.reordering\nSelect\n)\x81q\x01}Va\nh\x01sb.";
  EXPECT_THAT(ReadNumbers(chumpy), HasSubstr("nested too deeply"));
  const std::string own_state = "}q\x01Vx\nh\x01s.";
  EXPECT_EQ(Read(own_state), "no error");
}

TEST(HostilePickle, WorkThatIsRepeatedIsPaidFor) {
  const std::string text = "X" + LittleEndian(1 << 20, 4) + std::string(1 << 20, 'x') + "q\x01";
  const std::string encode = "c_codecs\nencode\nq\x02(h\x01Vlatin1\ntq\x03R";
  EXPECT_THAT(Read(text + encode + Repeat("0h\x02h\x03R", 100000) + "."),
              HasSubstr("would take more than"));
  const std::string list = "(" + Repeat("N", 1 << 20) + "lq\x01";
  const std::string set = "c__builtin__\nset\nq\x02(h\x01tq\x03R";
  EXPECT_THAT(Read(list + set + Repeat("0h\x02h\x03R", 100000) + "."),
              HasSubstr("would take more than"));
  // Long keys that differ only at the end, in many dicts.
  const std::string key(1 << 20, 'k');
  const std::string keys = "X" + LittleEndian(key.size() + 1, 4) + key + "aq\x01X" +
                           LittleEndian(key.size() + 1, 4) + key + "bq\x02";
  EXPECT_EQ(Read("(" + keys + Repeat("}(h\x01Nh\x02Nu", 200000) + "l."), "no error");
  EXPECT_EQ(Read("(d" + Repeat("K\x01Ns", 1000000) + "."), "no error");
}

std::string Array(std::string_view shape, std::string_view type, std::string_view data) {
  return fmt::format(
      "cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntR(I1\n{}cnumpy\ndtype\n"
      "(S'{}'\nI0\nI1\ntR(I3\nS'<'\nNNNI-1\nI-1\nI0\ntbI00\n{}tb.",
      shape, type, data);
}

TEST(HostilePickle, ArraysHaveTheBytesThatTheirShapeSays) {
  EXPECT_EQ(ReadNumbers(Array("(I2\nt", "u1", "S'ab'\n")), "no error");
  const std::pair<std::string, std::string> lies[] = {
      {Array("(I3\nt", "u1", "S'ab'\n"),
       "has an array of shape (3) and 1 bytes each, with 2 bytes"},
      {Array("(I1099511627776\nt", "u1", "S'ab'\n"), "with 2 bytes"},
      {Array("(I4294967296\nI4294967296\nt", "u1", "S''\n"), "with 0 bytes"},
      {Array("(I9223372036854775807\nI2\nt", "f8", "S'ab'\n"), "with 2 bytes"},
      {Array("(I-2\nt", "u1", "S'ab'\n"), "impossible shape"},
      {Array("(" + Repeat("I1\n", 33) + "t", "u1", "S'a'\n"), "impossible shape"},
      {Array("(I2\nt", "f3", "S'abcdef'\n"), "holds numbers longer than 64 bits"},
      {Array("(I2\nt", "U99999999999", "S'ab'\n"), "are not read"},
      {Array("(I2\nt", "O8", "S'ab'\n"), "has an array of objects without a list"},
      {Array("(I2\nt", "O8", "(I1\nl"), "has an array of shape (2) with 1 objects"},
      {Array("(I2\nt", "u1", "(I1\nl"), "with no bytes"},
      {Array("I2\n", "u1", "S'ab'\n"), "impossible shape"},
      {Array("(I2\nt", "", "S'ab'\n"), "has a dtype without a type"},
  };
  for (const auto& [pickle, message] : lies) EXPECT_THAT(ReadNumbers(pickle), HasSubstr(message));
}

std::string Sparse(std::string_view shape, std::string_view indices, std::string_view indptr) {
  return fmt::format(
      "cscipy.sparse.csc\ncsc_matrix\n)\x81(V_shape\n{}Vdata\n(F1.5\nF2.5\nlVindices\n{}Vindptr\n{}"
      "db.",
      shape, indices, indptr);
}

TEST(HostilePickle, SparseMatricesStayInside) {
  EXPECT_EQ(ReadNumbers(Sparse("(I2\nI2\nt", "(I0\nI1\nl", "(I0\nI1\nI2\nl")), "no error");
  const std::pair<std::string, std::string> lies[] = {
      {Sparse("(I2\nI2\nt", "(I0\nI2\nl", "(I0\nI1\nI2\nl"), "entries lie outside it"},
      {Sparse("(I2\nI2\nt", "(I0\nI-1\nl", "(I0\nI1\nI2\nl"), "entries lie outside it"},
      {Sparse("(I2\nI2\nt", "(I0\nI1\nl", "(I0\nI9\nI2\nl"), "indptr does not fit"},
      {Sparse("(I2\nI2\nt", "(I0\nI1\nl", "(I0\nI2\nI1\nl"), "indptr does not fit"},
      {Sparse("(I2\nI2\nt", "(I0\nI1\nl", "(I0\nI1\nl"), "indptr does not fit"},
      {Sparse("(I2\nI2\nt", "(I0\nI1\nl", "(I-5\nI1\nI2\nl"), "indptr does not fit"},
      {Sparse("(I1000000\nI1000000\nt", "(I0\nI1\nl", "(I0\nl"), "too large to be filled"},
      {Sparse("(I-1\nI2\nt", "(I0\nI1\nl", "(I0\nl"), "shape is not two sizes"},
      {Sparse("(I2\nt", "(I0\nI1\nl", "(I0\nl"), "shape is not two sizes"},
  };
  for (const auto& [pickle, message] : lies) EXPECT_THAT(ReadNumbers(pickle), HasSubstr(message));
}

TEST(HostilePickle, EveryOpcodeAloneIsAnErrorOrAValue) {
  for (int opcode = 0; opcode < 256; ++opcode) {
    SCOPED_TRACE(opcode);
    for (const char* before : {"", "(", "N", "(N", "NN", "]", "}", "](", "}("}) {
      const std::string start = before + std::string(1, static_cast<char>(opcode));
      for (const std::string& after :
           {std::string("."), std::string("\0\0\0\0\0\0\0\0.", 9), std::string("a\nb\n.")}) {
        const std::string outcome = Bounded(0, [&] { ReadPickleText(start + after); });
        EXPECT_TRUE(outcome == "no error" || outcome.starts_with("x.pkl: ")) << outcome;
      }
    }
  }
  for (const char* opcode :
       {"0",    "1",     "2",    "a",    "b",    "d",    "e",    "l",    "o",
        "p0\n", "q\x01", "Q",    "R",    "s",    "t",    "u",    "\x81", "\x85",
        "\x86", "\x87",  "\x90", "\x91", "\x92", "\x93", "\x94", "\x98"}) {
    EXPECT_THAT(Read(opcode + std::string(".")), HasSubstr("x.pkl: is not a whole pickle"))
        << opcode;
  }
  EXPECT_THAT(Read(""), HasSubstr("ends too early (at byte 0)"));
  EXPECT_THAT(Read("N"), HasSubstr("ends too early (at byte 1)"));
  EXPECT_THAT(Read("NN."), HasSubstr("does not end with one value"));
}

TEST(HostilePickle, CutOffAnywhere) {
  for (const char* name : {"mano_p0.pkl", "mano_p2.pkl", "mano_p5.pkl", "plain_p0.pkl",
                           "plain_p4.pkl", "arrays_python2_p2.pkl", "arrays_p5.pkl"}) {
    const std::vector<std::byte> bytes = testing::ReadBytes(PickleFixtures() / name);
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      // In a buffer of that very length, so that a sanitizer sees a byte too many.
      const std::vector<std::byte> cut(bytes.begin(), bytes.begin() + static_cast<long>(length));
      EXPECT_THROW(ReadPickle({cut, nullptr}, "x.pkl"), Error) << name << " at " << length;
    }
  }
}

}  // namespace
}  // namespace holdfast
