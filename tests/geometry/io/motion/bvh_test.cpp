// SPDX-License-Identifier: MIT
#include "geometry/io/motion/bvh.h"

#include <algorithm>
#include <fstream>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/import/file_kind.h"
#include "geometry/import/import_motion.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/zip_bytes.h"

namespace holdfast {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

constexpr char kTwoJoints[] =
    "HIERARCHY\n"
    "ROOT Hips\n"
    "{\n"
    "  OFFSET 5 6 7\n"
    "  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    "  JOINT left arm\n"
    "  {\n"
    "    OFFSET 10 0 0\n"
    "    CHANNELS 3 Yrotation Zrotation Xrotation\n"
    "    End Site\n"
    "    {\n"
    "      OFFSET 0 20 0\n"
    "    }\n"
    "  }\n"
    "}\n"
    "MOTION\n"
    "Frames: 2\n"
    "Frame Time: 0.0083333\n"
    "0 100 0 0 0 0 0 0 0\n"
    "1 2 3 90 0 0 0 0 90\n";

std::string WithReplaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

void ExpectFault(const std::string& text, const std::string& part) {
  try {
    ParseBvh(text, "test.bvh");
    ADD_FAILURE() << "was accepted, expected: " << part;
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("test.bvh:"), HasSubstr(part)));
    EXPECT_FALSE(error.Remedy().empty());
  }
}

SourceMotion Changed(const std::string& from, const std::string& to) {
  return ParseBvh(WithReplaced(kTwoJoints, from, to), "test.bvh");
}

TEST(Bvh, ReadsTheSkeletonInMeters) {
  const SourceMotion motion = ParseBvh(kTwoJoints, "test.bvh");
  EXPECT_THAT(motion.joint_names, ElementsAre("Hips", "left arm"));
  EXPECT_THAT(motion.parents, ElementsAre(-1, 0));
  EXPECT_TRUE(motion.rest_offsets.col(1).isApprox(Eigen::Vector3d(0.1, 0, 0)));
  ASSERT_EQ(motion.end_sites.size(), 1u);
  EXPECT_EQ(motion.end_sites[0].parent, 1);
  EXPECT_TRUE(motion.end_sites[0].offset.isApprox(Eigen::Vector3d(0, 0.2, 0)));
  EXPECT_EQ(motion.frame_rate, 120);
  EXPECT_EQ(motion.NumFrames(), 2);
}

TEST(Bvh, PosesAgreeWithHandComputation) {
  const SourceMotion motion = ParseBvh(kTwoJoints, "test.bvh");
  // Frame 0: positions stand in for the offset, no rotation.
  EXPECT_TRUE(motion.positions[0].col(0).isApprox(Eigen::Vector3d(0, 1, 0)));
  EXPECT_TRUE(motion.positions[0].col(1).isApprox(Eigen::Vector3d(0.1, 1, 0)));
  // Frame 1: 90 degrees about z carry the arm's x offset to y; then 90 about x in the arm.
  EXPECT_TRUE(motion.positions[1].col(1).isApprox(Eigen::Vector3d(0.01, 0.12, 0.03), 1e-12));
  const Eigen::Vector3d tip = motion.Rotation(1, 1) * Eigen::Vector3d(0, 0.2, 0);
  EXPECT_TRUE(tip.isApprox(Eigen::Vector3d(0, 0, 0.2), 1e-12)) << tip.transpose();
}

TEST(Bvh, RotationChannelsMultiplyFromLeftToRight) {
  const SourceMotion motion = Changed("1 2 3 90 0 0 0 0 90", "0 0 0 30 40 50 0 0 0");
  const auto turn = [](double degrees, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis);
  };
  const Eigen::Matrix3d expected =
      (turn(30, Eigen::Vector3d::UnitZ()) * turn(40, Eigen::Vector3d::UnitX()) *
       turn(50, Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  EXPECT_TRUE(motion.Rotation(1, 0).toRotationMatrix().isApprox(expected, 1e-12));
}

TEST(Bvh, PositionChannelsOfAnyJointStandInForItsOffset) {
  std::string text = WithReplaced(kTwoJoints, "CHANNELS 3 Yrotation Zrotation Xrotation",
                                  "CHANNELS 2 Yposition Xrotation");
  text = WithReplaced(text, "0 100 0 0 0 0 0 0 0", "0 0 0 0 0 0 3 0");
  text = WithReplaced(text, "1 2 3 90 0 0 0 0 90", "0 0 0 0 0 0 4 0");
  const SourceMotion motion = ParseBvh(text, "test.bvh");
  EXPECT_TRUE(motion.positions[0].col(1).isApprox(Eigen::Vector3d(0.1, 0.03, 0)));
  EXPECT_TRUE(motion.positions[1].col(1).isApprox(Eigen::Vector3d(0.1, 0.04, 0)));
}

TEST(Bvh, LineEndingsAndLetterCaseDoNotMatter) {
  std::string text;
  for (const char c : std::string(kTwoJoints)) {
    if (c == '\n') text += '\r';
    text += c;
  }
  text = WithReplaced(text, "HIERARCHY", "hierarchy");
  text = WithReplaced(text, "Zrotation", "zRotation");
  const SourceMotion motion = ParseBvh(text, "test.bvh");
  EXPECT_THAT(motion.joint_names, ElementsAre("Hips", "left arm"));
  EXPECT_TRUE(motion.positions[1].col(1).isApprox(Eigen::Vector3d(0.01, 0.12, 0.03), 1e-12));
}

TEST(Bvh, LengthUnitIsAnArgument) {
  const SourceMotion motion = ParseBvh(kTwoJoints, "test.bvh", 1.0);
  EXPECT_TRUE(motion.rest_offsets.col(1).isApprox(Eigen::Vector3d(10, 0, 0)));
  EXPECT_TRUE(motion.positions[0].col(0).isApprox(Eigen::Vector3d(0, 100, 0)));
}

TEST(Bvh, RepeatedNamesAreKept) {
  EXPECT_THAT(Changed("left arm", "Hips").joint_names, ElementsAre("Hips", "Hips"));
}

TEST(Bvh, AnotherNumberOfFramesIsNotedNotRefused) {
  for (const std::string announced : {"1", "3", "40"}) {
    const SourceMotion motion = Changed("Frames: 2", "Frames: " + announced);
    EXPECT_EQ(motion.NumFrames(), 2);
    EXPECT_THAT(motion.notes, ElementsAre(HasSubstr("announces " + announced)));
  }
  EXPECT_THAT(Changed("Frames: 2", "Frames: 40").notes[0],
              AllOf(HasSubstr("but the file has 2"), HasSubstr("incomplete")));
}

TEST(Bvh, DecimalCommasAreReadAndNoted) {
  std::string text = WithReplaced(kTwoJoints, "0.0083333", "0,0083333");
  text = WithReplaced(text, "OFFSET 10 0 0", "OFFSET 10,5 0 -,5e-1");
  const SourceMotion motion = ParseBvh(text, "test.bvh");
  EXPECT_TRUE(motion.rest_offsets.col(1).isApprox(Eigen::Vector3d(0.105, 0, -0.0005)));
  EXPECT_EQ(motion.frame_rate, 120);
  EXPECT_THAT(motion.notes, ElementsAre(HasSubstr("decimal commas")));
  // Where points are decimal, a comma parts thousands or is a mistake.
  ExpectFault(WithReplaced(text, "0,0083333", "0.0083333"), "test.bvh:8");
  // Names may hold commas.
  const SourceMotion named = Changed("left arm", "arm, left");
  EXPECT_THAT(named.joint_names, ElementsAre("Hips", "arm, left"));
  EXPECT_TRUE(named.notes.empty());
}

TEST(Bvh, OfSeveralRootsTheLargestTreeIsTakenAndNoted) {
  const std::string camera =
      "ROOT camera\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
      "End Site\n{\nOFFSET 0 0 1\n}\n}\n";
  std::string behind = WithReplaced(kTwoJoints, "MOTION\n", camera + "MOTION\n");
  behind = WithReplaced(behind, "0 100 0 0 0 0 0 0 0", "0 100 0 0 0 0 0 0 0 7 7 7");
  behind = WithReplaced(behind, "1 2 3 90 0 0 0 0 90", "1 2 3 90 0 0 0 0 90 8 8 8");
  std::string before = WithReplaced(kTwoJoints, "ROOT Hips", camera + "ROOT Hips");
  before = WithReplaced(before, "0 100 0 0 0 0 0 0 0", "7 7 7 0 100 0 0 0 0 0 0 0");
  before = WithReplaced(before, "1 2 3 90 0 0 0 0 90", "8 8 8 1 2 3 90 0 0 0 0 90");
  const SourceMotion alone = ParseBvh(kTwoJoints, "test.bvh");
  for (const std::string& text : {behind, before}) {
    const SourceMotion motion = ParseBvh(text, "test.bvh");
    EXPECT_THAT(motion.joint_names, ElementsAre("Hips", "left arm"));
    EXPECT_THAT(motion.parents, ElementsAre(-1, 0));
    ASSERT_EQ(motion.end_sites.size(), 1u);
    EXPECT_EQ(motion.end_sites[0].parent, 1);
    EXPECT_EQ(motion.rest_offsets, alone.rest_offsets);
    ASSERT_EQ(motion.NumFrames(), 2);
    for (int t = 0; t < 2; ++t) {
      EXPECT_EQ(motion.positions[t], alone.positions[t]);
      EXPECT_EQ(motion.Rotation(t, 1).coeffs(), alone.Rotation(t, 1).coeffs());
    }
    EXPECT_THAT(motion.notes, ElementsAre(AllOf(HasSubstr("2 roots"), HasSubstr("'Hips'"))));
  }
}

// As other systems save texts: UTF-16 with and without its mark, UTF-8 with one, old line ends.
TEST(Bvh, OtherEncodingsAndLineEndsAreReadAndNoted) {
  const TemporaryFolder folder;
  const std::string plain = WithReplaced(kTwoJoints, "left arm", "left\tarm");
  const auto utf16 = [&](bool big, bool mark) {
    std::string bytes = !mark ? "" : big ? "\xFE\xFF" : "\xFF\xFE";
    for (const char c : plain) {
      if (big) bytes += '\0';
      bytes += c;
      if (!big) bytes += '\0';
    }
    return bytes;
  };
  std::string returns = plain;
  std::ranges::replace(returns, '\n', '\r');
  const std::pair<std::string, const char*> files[] = {
      {utf16(false, true), "UTF-16"},    {utf16(true, true), "UTF-16"},
      {utf16(false, false), "UTF-16"},   {utf16(true, false), "UTF-16"},
      {"\xEF\xBB\xBF" + plain, "UTF-8"}, {returns, "carriage returns"}};
  for (const auto& [bytes, note] : files) {
    std::ofstream(folder / "a.bvh", std::ios::binary) << bytes;
    const SourceMotion motion = ReadBvh(folder / "a.bvh");
    EXPECT_EQ(motion.NumFrames(), 2) << note;
    EXPECT_THAT(motion.joint_names, ElementsAre("Hips", "left\tarm")) << note;
    EXPECT_TRUE(motion.positions[1].col(1).isApprox(Eigen::Vector3d(0.01, 0.12, 0.03), 1e-12));
    EXPECT_THAT(motion.notes, ElementsAre(HasSubstr(note)));
    EXPECT_TRUE(LooksLikeMotionFile(folder / "a.bvh")) << note;
    EXPECT_EQ(ReadMotion(folder / "a.bvh").notes, motion.notes);
    EXPECT_EQ(Identify(folder / "a.bvh").kind, FileKind::kBvh) << note;
  }
}

TEST(PlainText, KeepsLettersBeyondAsciiAndWhatIsNoText) {
  std::vector<std::string> notes;
  // A bone and a musical clef, which takes two units.
  std::string bytes("\xFF\xFE", 2);
  for (const char16_t unit : {u'\u9AA8', char16_t{0xD834}, char16_t{0xDD1E}, u'\u00E9'}) {
    bytes += static_cast<char>(unit & 0xFF);
    bytes += static_cast<char>(unit >> 8);
  }
  EXPECT_EQ(PlainText(bytes, notes), "\xE9\xAA\xA8\xF0\x9D\x84\x9E\xC3\xA9");
  EXPECT_EQ(notes.size(), 1u);
  const std::string binary("glTF\2\0\0\0\r\0\0\0\r\r\r\r\r\r", 18);
  EXPECT_EQ(PlainText(binary, notes), binary);
  EXPECT_EQ(PlainText("", notes), "");
  EXPECT_EQ(notes.size(), 1u);
}

TEST(Bvh, FaultsNameLineAndRemedy) {
  const std::string text = kTwoJoints;
  ExpectFault("", "HIERARCHY");
  ExpectFault("garbage", "HIERARCHY");
  ExpectFault("HIERARCHY\nJOINT a\n{", "ROOT");
  ExpectFault(WithReplaced(text, "OFFSET 10 0 0", "OFFSET 10 x 0"), "test.bvh:8");
  ExpectFault(WithReplaced(text, "OFFSET 10 0 0", "OFFSET 10 0"), "OFFSET");
  ExpectFault(WithReplaced(text, "Zrotation Xrotation Yrotation", "Zrotation Zrotation Yrotation"),
              "repeats");
  ExpectFault(WithReplaced(text, "CHANNELS 3 Y", "CHANNELS 3 Wrotation Y"), "channel 1 of 3");
  ExpectFault(WithReplaced(text, "CHANNELS 3", "CHANNELS 7"), "number of channels");
  ExpectFault(WithReplaced(text, "}\nMOTION", "}\nROOT b\n{\nMOTION"), "MOTION");
  ExpectFault(WithReplaced(text, "ROOT Hips", "ROOT "), "without a name");
  ExpectFault(WithReplaced(text, "Frames: 2", "Frames: 0"), "no frames");
  ExpectFault(WithReplaced(text, "Frames: 2", "Frames: -2"), "number of frames");
  ExpectFault(WithReplaced(text, "Frames: 2", "Frames: 99999999999"), "number of frames");
  ExpectFault(WithReplaced(WithReplaced(text, "Frames: 2", "Frames: 40"), "0 90\n", "0\n"),
              "ends in frame 2 of 40");
  ExpectFault(WithReplaced(text, "0.0083333", "0"), "frame time");
  ExpectFault(WithReplaced(text, "0.0083333", "nan"), "not finite");
  ExpectFault(WithReplaced(text, "1 2 3 90", "1 2 inf 90"), "not finite");
  ExpectFault(WithReplaced(text, "1 2 3 90", "1 2 nan 90"), "test.bvh:20");
  ExpectFault(WithReplaced(text, "1 2 3 90 0 0 0 0 90", "1 2 3 90 0 0 0"), "after 7 of 9");
  ExpectFault(WithReplaced(text, "1 2 3 90 0 0 0 0 90", "1 2 3 90 0 0 0 0 90 4"), "after 1 of 9");
  ExpectFault(
      WithReplaced(text, "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
                   "CHANNELS 0"),
      "more numbers");
}

TEST(Bvh, EveryPrefixIsRefusedWithoutACrash) {
  const std::string text = kTwoJoints;
  for (std::size_t length = 0; length + 24 < text.size(); ++length) {
    EXPECT_THROW(ParseBvh(text.substr(0, length), "test.bvh"), Error) << length;
  }
}

TEST(Bvh, DeepNestingEndsInAnErrorNotOnTheStack) {
  std::string text = "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n";
  for (int i = 0; i < 300000; ++i) text += "JOINT a\n{\nOFFSET 0 0 0\n";
  ExpectFault(text, "joints");
}

TEST(Bvh, ReadsGzipAndTellsDamage) {
  const TemporaryFolder folder;
  const auto path = folder / "motion.bvh.gz";
  std::string bytes = testing::Gzipped(kTwoJoints);
  std::ofstream(path, std::ios::binary) << bytes;
  EXPECT_EQ(ReadBvh(path).NumFrames(), 2);
  EXPECT_THROW(ReadGzipText(path, 100), Error);
  std::ofstream(folder / "cut.bvh.gz", std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  EXPECT_THROW(ReadBvh(folder / "cut.bvh.gz"), Error);
  bytes[bytes.size() / 2] = static_cast<char>(~bytes[bytes.size() / 2]);
  std::ofstream(folder / "bad.bvh.gz", std::ios::binary) << bytes;
  EXPECT_THROW(ReadBvh(folder / "bad.bvh.gz"), Error);
  EXPECT_THROW(ReadBvh(folder / "absent.bvh"), Error);
  EXPECT_THROW(ReadBvh(folder.Path()), Error);
}

}  // namespace
}  // namespace holdfast
