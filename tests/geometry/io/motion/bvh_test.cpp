// SPDX-License-Identifier: MIT
#include "geometry/io/motion/bvh.h"

#include <fstream>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "geometry/error.h"
#include "geometry/io/container/gzip.h"
#include "tests/support/temporary_folder.h"

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

TEST(Bvh, ReadsTheSkeletonInMetres) {
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
  const std::string zxy = WithReplaced(kTwoJoints, "1 2 3 90 0 0 0 0 90", "0 0 0 30 40 50 0 0 0");
  const SourceMotion motion = ParseBvh(zxy, "test.bvh");
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
  const SourceMotion motion = ParseBvh(WithReplaced(kTwoJoints, "left arm", "Hips"), "test.bvh");
  EXPECT_THAT(motion.joint_names, ElementsAre("Hips", "Hips"));
}

TEST(Bvh, HeaderOffByOneWholeFrameIsNotedNotRefused) {
  const SourceMotion fewer =
      ParseBvh(WithReplaced(kTwoJoints, "Frames: 2", "Frames: 3"), "test.bvh");
  EXPECT_EQ(fewer.NumFrames(), 2);
  EXPECT_THAT(fewer.notes, ElementsAre(HasSubstr("announces 3")));
  const SourceMotion more =
      ParseBvh(WithReplaced(kTwoJoints, "Frames: 2", "Frames: 1"), "test.bvh");
  EXPECT_EQ(more.NumFrames(), 2);
  EXPECT_EQ(more.notes.size(), 1u);
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
  ExpectFault(WithReplaced(text, "Frames: 2", "Frames: 40"), "ends in frame 3 of 40");
  ExpectFault(WithReplaced(text, "0.0083333", "0"), "frame time");
  ExpectFault(WithReplaced(text, "0.0083333", "nan"), "not finite");
  ExpectFault(WithReplaced(text, "1 2 3 90", "1 2 inf 90"), "not finite");
  ExpectFault(WithReplaced(text, "1 2 3 90", "1 2 nan 90"), "test.bvh:20");
  ExpectFault(WithReplaced(text, "1 2 3 90 0 0 0 0 90", "1 2 3 90 0 0 0"), "after 7 of 9");
  ExpectFault(WithReplaced(text, "1 2 3 90 0 0 0 0 90", "1 2 3 90 0 0 0 0 90 4"), "after 1 of 9");
  ExpectFault(
      WithReplaced(text, "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
                   "CHANNELS 0"),
      "go on");
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
  const auto path = (folder / "motion.bvh.gz");
  const gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, kTwoJoints, sizeof(kTwoJoints) - 1);
  gzclose(file);
  EXPECT_EQ(ReadBvh(path).NumFrames(), 2);
  EXPECT_THROW(ReadGzipText(path, 100), Error);

  std::string bytes;
  {
    std::ifstream in(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
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
