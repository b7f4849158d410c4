// SPDX-License-Identifier: MIT
#include "geometry/io/markers/c3d.h"
#include "geometry/io/markers/marker_tables.h"

#include <array>
#include <bit>
#include <cstdint>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/support/data_folder.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::ElementsAre;
using testing::ErrorText;
using ::testing::HasSubstr;

// A C3D file of two points and three frames, of any processor, integers or floats.
class C3dFile {
 public:
  C3dFile(int processor, bool floats) : processor_(processor), floats_(floats) {
    bytes_.assign(3 * 512, '\0');
    bytes_[0] = 2;
    bytes_[1] = 0x50;
    PutWord(2, 2);
    PutWord(4, 1);  // an analog value a frame, between the points
    PutWord(6, 11);
    PutWord(8, 13);
    PutFloat(12, floats ? -1.0F : 0.5F);
    PutWord(16, 4);
    PutFloat(20, 120.0F);
    at_ = 512 + 4;
    bytes_[512 + 2] = 2;
    bytes_[512 + 3] = static_cast<char>(processor);
    Group(1, "POINT");
    Parameter(1, "LABELS", -1, {6, 2}, "P1:toeHEEL  ");
    Parameter(1, "units", -1, {2}, "cm");
    Parameter(1, "RATE", 4, {}, std::string(4, '\0'));
    PutFloat(at_ - 5, 120.0F);
    for (int t = 0; t < 3; ++t) {
      for (int p = 0; p < 2; ++p) {
        for (int c = 0; c < 3; ++c) Append(Value(p, c, t));
        Append(p == 1 && t == 2 ? -1.0 : 0.0);
      }
      Append(77.0);
    }
  }

  static double Value(int point, int axis, int frame) {
    return 100.0 * point - 10.0 * axis + frame;
  }
  const std::string& Bytes() const { return bytes_; }
  void SetPoint(int point, int frame, const std::array<double, 3>& place, double residual) {
    const std::size_t number = floats_ ? 4 : 2;
    const auto before = static_cast<std::size_t>(9 * frame + 4 * point);  // two points, an analog
    std::string rest = bytes_.substr(3 * 512 + number * (before + 4));
    bytes_.resize(3 * 512 + number * before);
    for (const double c : place) Append(c);
    Append(residual);
    bytes_ += rest;
  }

 private:
  void PutWord(std::size_t at, unsigned value) {
    const bool big = processor_ == 86;
    bytes_[at] = static_cast<char>(big ? value >> 8 : value & 255);
    bytes_[at + 1] = static_cast<char>(big ? value & 255 : value >> 8);
  }
  void PutFloat(std::size_t at, float value) {
    const auto bits = std::bit_cast<std::uint32_t>(processor_ == 85 ? 4.0F * value : value);
    const bool high_first = processor_ != 84;
    PutWord(at, high_first ? bits >> 16 : bits & 65535);
    PutWord(at + 2, high_first ? bits & 65535 : bits >> 16);
  }
  void Append(double value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + (floats_ ? 4 : 2));
    if (floats_) {
      PutFloat(at, static_cast<float>(value));
    } else {  // of scale 0.5; the residual and analog values have none
      const double scaled = value == -1.0 || value == 77.0 ? value : 2.0 * value;
      PutWord(at, static_cast<std::uint16_t>(static_cast<std::int16_t>(scaled)));
    }
  }
  void Put(const std::string& text) {
    bytes_.replace(at_, text.size(), text);
    at_ += text.size();
  }
  void Group(int id, const std::string& name) {
    Put(std::string{static_cast<char>(name.size()), static_cast<char>(-id)} + name);
    PutWord(at_, 3);
    at_ += 3;
  }
  void Parameter(int id, const std::string& name, int type, const std::vector<int>& size,
                 const std::string& data) {
    Put(std::string{static_cast<char>(name.size()), static_cast<char>(id)} + name);
    PutWord(at_, static_cast<unsigned>(2 + 2 + size.size() + data.size() + 1));
    at_ += 2;
    Put(std::string{static_cast<char>(type), static_cast<char>(size.size())});
    for (const int n : size) Put(std::string(1, static_cast<char>(n)));
    Put(data);
    ++at_;  // no description
  }

  int processor_;
  bool floats_;
  std::string bytes_;
  std::size_t at_ = 0;
};

TEST(C3d, ReadsEveryProcessorsIntegersAndFloats) {
  for (const int processor : {84, 85, 86}) {
    for (const bool floats : {false, true}) {
      SCOPED_TRACE(::testing::Message() << processor << (floats ? " floats" : " integers"));
      const MarkerRecording recording = ParseC3d(C3dFile(processor, floats).Bytes(), "a.c3d");
      EXPECT_THAT(recording.names, ElementsAre("toe", "HEEL"));
      EXPECT_THAT(recording.subjects, ElementsAre("P1", ""));
      EXPECT_EQ(recording.NumFrames(), 3);
      EXPECT_EQ(recording.first_frame, 11);
      EXPECT_EQ(recording.rate_hz, 120.0);
      EXPECT_EQ(recording.unit, "cm");
      for (int t = 0; t < 3; ++t) {
        for (int p = 0; p < 2; ++p) {
          EXPECT_EQ(recording.Seen(p, t), p == 0 || t < 2);
          if (!recording.Seen(p, t)) continue;
          for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(recording.At(p, t)[c], 0.01 * C3dFile::Value(p, c, t), 1e-9);
          }
        }
      }
      EXPECT_EQ(recording.Find("heel"), 1);
      EXPECT_EQ(recording.Find("knee"), std::nullopt);
    }
  }
}

// Two ways of saying that a point is not seen: a residual of -1, and three zeros with a residual
// that says it is. One zero alone is a place.
TEST(C3d, ZerosAndNegativeResidualsAreNotSeen) {
  for (const bool floats : {false, true}) {
    SCOPED_TRACE(floats ? "floats" : "integers");
    C3dFile file(84, floats);
    file.SetPoint(0, 1, {0.0, 0.0, 0.0}, 0.0);
    file.SetPoint(1, 0, {0.0, 0.0, 0.0}, -1.0);
    file.SetPoint(1, 1, {0.0, 0.0, 7.0}, 0.0);
    const MarkerRecording recording = ParseC3d(file.Bytes(), "a.c3d");
    EXPECT_TRUE(recording.Seen(0, 0));
    EXPECT_FALSE(recording.Seen(0, 1));
    EXPECT_TRUE(recording.Seen(0, 2));
    EXPECT_FALSE(recording.Seen(1, 0));
    EXPECT_TRUE(recording.Seen(1, 1));
    EXPECT_NEAR(recording.At(1, 1).z(), 0.07, 1e-9);
    EXPECT_FALSE(recording.Seen(1, 2));  // has a place, and a residual of -1
  }
}

TEST(C3d, CutOffAnywhereItSaysSo) {
  const std::string whole = C3dFile(84, true).Bytes();
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    EXPECT_THROW(ParseC3d(std::string_view(whole).substr(0, size), "a.c3d"), Error) << size;
  }
}

// Any byte of head and parameters changed: an Error or a recording, never a crash.
TEST(C3d, SurvivesEveryChangedByte) {
  const std::string whole = C3dFile(84, false).Bytes();
  int read = 0;
  for (std::size_t at = 0; at < 700; ++at) {
    for (const int value : {0, 1, 127, 255}) {
      std::string changed = whole;
      changed[at] = static_cast<char>(value);
      try {
        const MarkerRecording recording = ParseC3d(changed, "a.c3d");
        EXPECT_EQ(recording.positions.rows(), 3 * recording.NumMarkers());
        ++read;
      } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("a.c3d"));
      }
    }
  }
  EXPECT_GT(read, 1000);
}

const std::filesystem::path kPyC3d = HOLDFAST_SOURCE_DIR "/tests/fixtures/c3d/py_c3d.c3d";

// tests/fixtures/c3d/README.md: little-endian floats, labels of five characters, arrays without
// elements, frame numbers as pairs of words.
TEST(C3d, ReadsWhatPyC3dWrote) {
  const MarkerRecording recording = ReadMarkers(kPyC3d);
  EXPECT_THAT(recording.names, ElementsAre("M000", "M001", "M002"));
  EXPECT_EQ(recording.rate_hz, 120.0);
  EXPECT_EQ(recording.first_frame, 1);
  ASSERT_EQ(recording.NumFrames(), 4);
  for (int t = 0; t < 4; ++t) {
    for (int p = 0; p < 3; ++p) {
      EXPECT_EQ(recording.Seen(p, t), p != 1 || t != 2);
      if (!recording.Seen(p, t)) continue;
      const Eigen::Vector3d millimeters(100.0 * p + t, 10.0 * p - t, 1000.5 + p);
      EXPECT_NEAR((recording.At(p, t) - 1e-3 * millimeters).norm(), 0.0, 1e-9);
    }
  }
}

// What another program wrote, written again and read, is the same.
TEST(C3d, RoundTripOfWhatPyC3dWrote) {
  const MarkerRecording recording = ReadMarkers(kPyC3d);
  const testing::TemporaryFolder folder;
  WriteC3d(recording, folder / "again.c3d");
  const MarkerRecording again = ReadMarkers(folder / "again.c3d");
  EXPECT_EQ(again.names, recording.names);
  EXPECT_EQ(again.rate_hz, recording.rate_hz);
  EXPECT_EQ(again.first_frame, recording.first_frame);
  ASSERT_EQ(again.NumFrames(), recording.NumFrames());
  for (int t = 0; t < recording.NumFrames(); ++t) {
    for (int p = 0; p < recording.NumMarkers(); ++p) {
      ASSERT_EQ(again.Seen(p, t), recording.Seen(p, t));
      if (recording.Seen(p, t)) {
        EXPECT_EQ(again.At(p, t), recording.At(p, t));
      }
    }
  }
}

MarkerRecording NumberedMarkers(int markers, int frames) {
  MarkerRecording recording;
  std::vector<std::string> labels;
  for (int m = 0; m < markers; ++m) labels.push_back(fmt::format("P{}:m{}", m % 2, m));
  SetMarkerNames(labels, "numbered", recording);
  recording.positions.setRandom(3 * markers, frames);
  recording.rate_hz = 119.88;
  recording.first_frame = 70'000;
  return recording;
}

TEST(C3d, WritesMoreLabelsAndFramesThanAWordCounts) {
  const MarkerRecording labels = NumberedMarkers(600, 2), frames = NumberedMarkers(1, 66'000);
  for (const MarkerRecording& recording : {labels, frames}) {
    const MarkerRecording again = ParseC3d(C3dBytes(recording, "a.c3d"), "a.c3d");
    EXPECT_EQ(again.names, recording.names);
    EXPECT_EQ(again.subjects, recording.subjects);
    EXPECT_EQ(again.first_frame, 70'000);
    EXPECT_NEAR(again.rate_hz, 119.88, 1e-5);
    ASSERT_EQ(again.NumFrames(), recording.NumFrames());
    EXPECT_LT((again.positions - recording.positions).cwiseAbs().maxCoeff(), 1e-7);
  }
}

TEST(C3d, SaysWhatItCannotHold) {
  const auto error = [](const MarkerRecording& recording) {
    return ErrorText([&] { C3dBytes(recording, "a.c3d"); });
  };
  EXPECT_THAT(error(NumberedMarkers(3, 0)), HasSubstr("a.c3d: 3 markers and 0 frames"));
  MarkerRecording named = NumberedMarkers(3, 1);
  named.names[1] = std::string(126, 'x');
  EXPECT_THAT(error(named), HasSubstr("the label of marker 1 has 129 bytes"));
  EXPECT_THAT(error(NumberedMarkers(20'000, 1)), HasSubstr("the labels of 20000 markers"));
}

constexpr const char* kTrc =
    "PathFileType\t4\t(X/Y/Z)\tx.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n"
    "60\t60\t2\t2\tm\n"
    "Frame#\tTime\tA\t\t\tB\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
    "\n"
    "5\t0.0\t1\t2\t3\t4\t5\t6\n"
    "6\t0.016\t1\t2\t3\t\t\t\n";

TEST(MarkerTables, ReadTrc) {
  const MarkerRecording recording = ParseTrc(kTrc, "x.trc");
  EXPECT_THAT(recording.names, ElementsAre("A", "B"));
  EXPECT_EQ(recording.rate_hz, 60.0);
  EXPECT_EQ(recording.first_frame, 5);
  EXPECT_EQ(recording.At(1, 0), Eigen::Vector3d(4, 5, 6));
  EXPECT_FALSE(recording.Seen(1, 1));
}

std::string Changed(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

std::string TrcFault(const std::string& text) {
  return ErrorText([&] { ParseTrc(text, "x.trc"); });
}

TEST(MarkerTables, NameLineAndField) {
  const auto error_of = [](const std::string& from, const std::string& to) {
    return TrcFault(Changed(kTrc, from, to));
  };
  EXPECT_THAT(error_of("\t4\t5\t6", "\t4\tfive\t6"), HasSubstr("x.trc:7: 'five'"));
  EXPECT_THAT(error_of("\t4\t5\t6", "\t4\tinf\t6"), HasSubstr("x.trc:7"));
  EXPECT_THAT(error_of("\t4\t5\t6", "\t4"), HasSubstr("8 are expected"));
  EXPECT_THAT(error_of("\tm\n", "\tfurlong\n"), HasSubstr("furlong"));
  EXPECT_THAT(error_of("60\t60", "0\t60"), HasSubstr("rate of 0 Hz"));
  EXPECT_THAT(error_of("\t4\t5\t6", "\t4\t5\t6\t7"), HasSubstr("9 fields, 8 are expected"));
  EXPECT_THAT(error_of("A\t\t\tB\t\t", "A\tB\t\t\t\t"), HasSubstr("the name 'B' is not above"));
}

const std::filesystem::path kCases = HOLDFAST_SOURCE_DIR "/tests/fixtures/cases";

// Rows say what there is; what contradicts them is a note.
TEST(MarkerTables, ReadWhatContradictsItselfWithANote) {
  const auto read = [](const std::string& text) { return ParseTrc(text, "x.trc"); };
  EXPECT_TRUE(read(kTrc).notes.empty());
  const MarkerRecording twice = read(Changed(kTrc, "\tB\t", "\tA\t"));
  EXPECT_THAT(twice.names, ElementsAre("A", "A_2"));
  EXPECT_THAT(twice.notes, ElementsAre(HasSubstr("the same name")));
  const MarkerRecording three = read(Changed(kTrc, "\t2\tm", "\t3\tm"));
  EXPECT_EQ(three.NumMarkers(), 2);
  EXPECT_THAT(three.notes, ElementsAre(HasSubstr("NumMarkers is 3, 2 are named")));
  const MarkerRecording commas = read(Changed(kTrc, "\t4\t5\t6", "\t4,5\t5\t6"));
  EXPECT_EQ(commas.At(1, 0), Eigen::Vector3d(4.5, 5, 6));
  EXPECT_THAT(commas.notes, ElementsAre(HasSubstr("decimal commas")));
  // The name of the second marker stays over its columns.
  const MarkerRecording nameless = read(Changed(kTrc, "\tA\t", "\t\t"));
  EXPECT_THAT(nameless.names, ElementsAre("point 1", "B"));
  EXPECT_EQ(nameless.At(1, 0), Eigen::Vector3d(4, 5, 6));
  EXPECT_THAT(nameless.notes, ElementsAre(HasSubstr("without a name")));
  const MarkerRecording cut = read(Changed(kTrc, "\tm\n", "\tmet\n"));
  EXPECT_EQ(cut.meters_per_unit, 1.0);
  EXPECT_THAT(cut.notes, ElementsAre(HasSubstr("'met' is cut off")));
  EXPECT_TRUE(read(Changed(kTrc, "\tm\n", "\tmillimeter\n")).notes.empty());

  const MarkerRecording whole = ReadMarkers(kCases / "trc_refused/numbers_twice.trc");
  EXPECT_THAT(whole.notes, ElementsAre(HasSubstr("NumMarkers is 82, 41 are named")));
  EXPECT_EQ(whole.NumMarkers(), 41);
  EXPECT_EQ(whole.NumFrames(), 20);
  EXPECT_NEAR(whole.At(0, 0).x(), 0.0484618, 1e-9);
  const MarkerRecording by_commas = ReadMarkers(kCases / "trc_refused/commas.trc");
  EXPECT_THAT(by_commas.notes, ElementsAre(HasSubstr("separated by ','")));
  const MarkerRecording longer = ReadMarkers(kCases / "trc_refused/longer_rows.trc");
  EXPECT_THAT(longer.notes, ElementsAre(HasSubstr("of 20 rows have positions of markers without")));
  for (const MarkerRecording& other : {by_commas, longer}) {
    EXPECT_EQ(other.names, whole.names);
    EXPECT_EQ(other.positions, whole.positions);
  }
}

TEST(MarkerTables, ReadViconTablesOfOtherLanguages) {
  const MarkerRecording recording = ParseViconCsv(
      "Trajectories\n100\n;;P:A;;;P:B;;\nFrame;Sub Frame;X;Y;Z;X;Y;Z\n;;mm;mm;mm;mm;mm;mm\n"
      "1;0;1,5;2;3;40;50;60\n",
      "x.csv");
  EXPECT_TRUE(recording.At(0, 0).isApprox(Eigen::Vector3d(0.0015, 0.002, 0.003)));
  EXPECT_THAT(recording.notes, ElementsAre(HasSubstr("decimal commas")));
}

// As BTK and ezc3d read them.
TEST(C3d, ReadsWhatContradictsItselfWithANote) {
  const auto read = [](const char* name) { return ReadMarkers(kCases / "c3d_refused" / name); };
  const MarkerRecording whole = read("link_beyond.c3d");
  EXPECT_THAT(whole.notes, ElementsAre(HasSubstr("link points beyond the section")));
  EXPECT_EQ(whole.NumMarkers(), 41);
  const MarkerRecording start = read("data_start_0.c3d");
  EXPECT_THAT(start.notes, ElementsAre(HasSubstr("read from block 3, as the header states")));
  EXPECT_EQ(start.positions, whole.positions);
  const MarkerRecording meters = read("meters.c3d");
  EXPECT_THAT(meters.notes, ElementsAre(HasSubstr("'mete' is cut off; read as meters")));
  EXPECT_EQ(meters.meters_per_unit, 1.0);
  const MarkerRecording twice = read("duplicate.c3d");
  EXPECT_THAT(twice.notes, ElementsAre(HasSubstr("LSHO_2")));
  EXPECT_TRUE(twice.Find("LSHO") && twice.Find("LSHO_2"));

  // SGI's: the same, bytes the other way round.
  for (const bool floats : {false, true}) {
    std::string bytes = C3dFile(86, floats).Bytes();
    const std::size_t link = bytes.find("RATE") + 4;
    bytes[link] = 8;  // 2048 and more, behind the parameters
    const MarkerRecording sgi = ParseC3d(bytes, "sgi.c3d");
    EXPECT_THAT(sgi.notes, ElementsAre(HasSubstr("link points beyond")));
    EXPECT_EQ(sgi.rate_hz, 120.0);
    EXPECT_NEAR(sgi.At(0, 1)[2], 0.01 * C3dFile::Value(0, 2, 1), 1e-9);
  }
}

TEST(SetMarkerNames, MakesUtf8OfAnyBytes) {
  MarkerRecording recording;
  SetMarkerNames({"P\xfc:h\xfc"
                  "fte",
                  "knie"},
                 "a.c3d", recording);
  EXPECT_THAT(recording.names, ElementsAre("h\u00fc"
                                           "fte",
                                           "knie"));
  EXPECT_THAT(recording.subjects, ElementsAre("P\u00fc", ""));
  EXPECT_THAT(recording.notes, ElementsAre(HasSubstr("read as Latin-1")));
}

// Of a file that was not copied whole the last line may end anywhere, between fields as well.
TEST(FindLengthUnit, KnowsEitherSpelling) {
  for (const char* unit : {"mm", "millimeters", "millimetres", "Millimetres", "mill"}) {
    const std::optional<LengthUnit> found = FindLengthUnit(unit);
    ASSERT_TRUE(found) << unit;
    EXPECT_EQ(found->meters, 1e-3) << unit;
  }
  EXPECT_EQ(FindLengthUnit("centimetres")->meters, 1e-2);
  EXPECT_EQ(FindLengthUnit("metres")->meters, 1.0);
  EXPECT_FALSE(FindLengthUnit("feet"));
}

TEST(MarkerTables, CutOffInALineTheySaySo) {
  const std::string trc = kTrc, whole = trc.substr(0, trc.rfind("6\t0.016"));
  const auto frames = [](const std::string& text) { return ParseTrc(text, "x.trc").NumFrames(); };
  EXPECT_THAT(TrcFault(whole + "6\t0.016\t1\t2\t3"), HasSubstr("x.trc:8: ends in the middle"));
  EXPECT_THAT(TrcFault(whole + "6\t0.016\t1\t2"), HasSubstr("8 are expected"));
  // No line's end at the end is no fault, nor what is not seen left out in other lines too.
  EXPECT_EQ(frames(whole + "6\t0.016\t1\t2\t3\t4\t5\t6"), 2);
  EXPECT_EQ(frames(whole + "6\t0.016\t1\t2\t3\n7\t0.033\t1\t2\t3"), 3);
}

TEST(MarkerTables, ZerosAreNotSeen) {
  const MarkerRecording recording = ParseTrc(Changed(kTrc, "\t4\t5\t6", "\t0\t0.0\t-0"), "x.trc");
  EXPECT_TRUE(recording.Seen(0, 0));
  EXPECT_FALSE(recording.Seen(1, 0));
}

TEST(MarkerTables, ReadQtmWithAndWithoutColumnNames) {
  const std::string head =
      "NO_OF_FRAMES\t1\r\nNO_OF_MARKERS\t2\r\nFREQUENCY\t200\r\nMARKER_NAMES\ta\tb\r\n";
  const MarkerRecording bare = ParseQtmTsv(head + "1\t2\t3\t0.000\t0.000\t0.000\r\n", "x.tsv");
  EXPECT_TRUE(bare.At(0, 0).isApprox(Eigen::Vector3d(0.001, 0.002, 0.003)));
  EXPECT_FALSE(bare.Seen(1, 0));
  const MarkerRecording named = ParseQtmTsv(
      head + "Frame\tTime\ta X\ta Y\ta Z\tb X\tb Y\tb Z\t\r\n9\t0.1\t1\t2\t3\tnan\tnan\tnan\r\n",
      "x.tsv");
  EXPECT_EQ(named.first_frame, 9);
  EXPECT_EQ(named.At(0, 0), bare.At(0, 0));
  EXPECT_FALSE(named.Seen(1, 0));
}

TEST(ReadMarkers, ReadsCapturesOfLaboratories) {
  const std::filesystem::path data = testing::DataFolder();
  const std::filesystem::path vicon = data / "adl/ADL001/ADL001DL1.csv.gz";
  const std::filesystem::path qualisys = data / "markers/dfki_pillow/recording.tsv.gz";
  if (!std::filesystem::exists(vicon) || !std::filesystem::exists(qualisys)) {
    GTEST_SKIP() << "no marker recordings in " << data << " (set HOLDFAST_DATA)";
  }
  const MarkerRecording drink = ReadMarkers(vicon);
  EXPECT_EQ(drink.format, "Vicon CSV");
  EXPECT_EQ(drink.NumMarkers(), 49);  // ten of them of the static trial alone
  EXPECT_EQ(drink.rate_hz, 100.0);
  EXPECT_EQ(drink.subjects.front(), "ADL001");
  ASSERT_TRUE(drink.Find("lftp"));
  for (int t = 0; t < drink.NumFrames(); ++t) EXPECT_TRUE(drink.Seen(*drink.Find("lftp"), t));
  EXPECT_FALSE(drink.Seen(*drink.Find("rlep"), 0));
  EXPECT_TRUE(drink.At(0, 0).isApprox(Eigen::Vector3d(0.12957, -0.29064, 0.35483), 1e-12));
  const MarkerRecording pillow = ReadMarkers(qualisys);
  EXPECT_EQ(pillow.NumFrames(), 6000);
  EXPECT_EQ(pillow.NumMarkers(), 21);
  int gone = 0;
  for (int t = 0; t < 6000; ++t) gone += pillow.Seen(*pillow.Find("thumb_tip"), t) ? 0 : 1;
  EXPECT_EQ(gone, 493);
  EXPECT_THROW(ReadMarkers(data / "README.md"), Error);
}

}  // namespace
}  // namespace holdfast
