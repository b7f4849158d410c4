// SPDX-License-Identifier: MIT
#include "geometry/io/motion/asf_amc.h"

#include <fstream>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/support/error_text.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

constexpr char kAsf[] =
    "# a comment\n"
    ":version 1.10\n"
    ":name test\n"
    ":units\n"
    "  mass 1.0\n"
    "  length 0.5\n"
    "  angle deg\n"
    ":documentation\n"
    "   two bones : one bent\n"
    ":root\n"
    "   order TX TY TZ RX RY RZ\n"
    "   axis XYZ\n"
    "   position 0 0 0\n"
    "   orientation 0 0 0\n"
    ":bonedata\n"
    "  begin\n"
    "     id 1\n"
    "     name thigh\n"
    "     direction 0 -2 0\n"
    "     length 10\n"
    "     axis 0 0 90 XYZ\n"
    "    dof rx ry\n"
    "    limits (-160.0 20.0)\n"
    "           (-70.0 70.0)\n"
    "  end\n"
    "  begin\n"
    "     id 2\n"
    "     name shin\n"
    "     direction 0 -1 0\n"
    "     length 8\n"
    "     axis 0 0 0 XYZ\n"
    "    dof rx\n"
    "    limits (-10.0 170.0)\n"
    "  end\n"
    ":hierarchy\n"
    "  begin\n"
    "    root thigh\n"
    "    thigh shin\n"
    "  end\n";

constexpr char kAmc[] =
    "#!OML:ASF test.asf\n"
    ":FULLY-SPECIFIED\n"
    ":DEGREES\n"
    "1\n"
    "root 1 2 3 0 0 0\n"
    "thigh 0 0\n"
    "shin 90\n"
    "2\n"
    "root 0 0 0 90 0 90\n"
    "shin 0\n"
    "thigh 90 0\n";

constexpr double kUnit = 0.0254 / 0.5;

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

void ExpectFault(const std::string& asf, const std::string& amc, const std::string& part) {
  try {
    ParseAmc(asf, "t.asf", amc, "t.amc");
    ADD_FAILURE() << "was accepted, expected: " << part;
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("t.a"), HasSubstr(part)));
    EXPECT_FALSE(error.Remedy().empty());
  }
}

TEST(AsfAmc, BonesBecomeJointsAtTheirStarts) {
  const SourceMotion motion = ParseAmc(kAsf, "t.asf", kAmc, "t.amc");
  EXPECT_THAT(motion.joint_names, ElementsAre("root", "thigh", "shin"));
  EXPECT_THAT(motion.parents, ElementsAre(-1, 0, 1));
  EXPECT_TRUE(motion.rest_offsets.col(1).isZero());
  EXPECT_TRUE(motion.rest_offsets.col(2).isApprox(Eigen::Vector3d(0, -10 * kUnit, 0)));
  ASSERT_EQ(motion.end_sites.size(), 1u);
  EXPECT_TRUE(motion.end_sites[0].offset.isApprox(Eigen::Vector3d(0, -8 * kUnit, 0)));
  EXPECT_EQ(motion.NumFrames(), 2);
  EXPECT_EQ(motion.frame_rate, 120);
}

TEST(AsfAmc, PosesAgreeWithHandComputation) {
  const SourceMotion motion = ParseAmc(kAsf, "t.asf", kAmc, "t.amc");
  EXPECT_TRUE(motion.positions[0].col(0).isApprox(kUnit * Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE(motion.positions[0].col(2).isApprox(kUnit * Eigen::Vector3d(1, -8, 3)));
  // The shin bent by 90 degrees about x: down becomes back (-z).
  EXPECT_TRUE((motion.Rotation(0, 2) * Eigen::Vector3d(0, -1, 0))
                  .isApprox(Eigen::Vector3d(0, 0, -1), 1e-12));

  // Frame 2. Root: about x first, then z: (x,y,z) -> (x,-z,y) -> (z,x,y).
  EXPECT_TRUE(
      (motion.Rotation(1, 0) * Eigen::Vector3d(1, 2, 3)).isApprox(Eigen::Vector3d(3, 1, 2), 1e-12));
  // The thigh's rx turns about its own axis, C x = y of the skeleton: -y stays where it is.
  EXPECT_TRUE(motion.positions[1].col(2).isApprox(
      motion.Rotation(1, 0) * Eigen::Vector3d(0, -10 * kUnit, 0), 1e-12));
  const Eigen::Matrix3d local =
      (motion.Rotation(1, 0).conjugate() * motion.Rotation(1, 1)).toRotationMatrix();
  EXPECT_TRUE(local.isApprox(
      Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY()).toRotationMatrix(), 1e-12));
}

TEST(AsfAmc, UnitsAndRateCanBeGiven) {
  const SourceMotion motion = ParseAmc(kAsf, "t.asf", kAmc, "t.amc", 1, 60);
  EXPECT_EQ(motion.frame_rate, 60);
  EXPECT_TRUE(motion.positions[0].col(0).isApprox(Eigen::Vector3d(1, 2, 3)));
}

TEST(AsfAmc, RadiansInTheMotionAreHeeded) {
  std::string amc = Replaced(kAmc, ":DEGREES", ":RADIANS");
  amc = Replaced(amc, "shin 90", "shin 1.5707963267948966");
  const SourceMotion motion = ParseAmc(kAsf, "t.asf", amc, "t.amc");
  EXPECT_TRUE((motion.Rotation(0, 2) * Eigen::Vector3d(0, -1, 0))
                  .isApprox(Eigen::Vector3d(0, 0, -1), 1e-12));
}

TEST(AsfAmc, SkeletonFaultsNameTheLine) {
  const std::string asf = kAsf;
  ExpectFault("", kAmc, "Acclaim");
  ExpectFault("HIERARCHY", kAmc, "Acclaim");
  ExpectFault(Replaced(asf, ":hierarchy", ":skin"), kAmc, ":hierarchy");
  ExpectFault(Replaced(asf, ":root", ":other"), kAmc, ":root");
  ExpectFault(Replaced(asf, "length 10", "length x"), kAmc, "t.asf:20");
  ExpectFault(Replaced(asf, "direction 0 -2 0", "direction 0 0 0"), kAmc, "no direction");
  ExpectFault(Replaced(asf, "direction 0 -2 0", "direction 0 nan 0"), kAmc, "not finite");
  ExpectFault(Replaced(asf, "name shin", "name thigh"), kAmc, "same name");
  ExpectFault(Replaced(asf, "dof rx ry", "dof rx rq"), kAmc, "degree of freedom");
  ExpectFault(Replaced(asf, "dof rx ry", "dof rx rx"), kAmc, "repeats");
  ExpectFault(Replaced(asf, "axis 0 0 90 XYZ", "axis 0 0 90 XXZ"), kAmc, "permutation");
  ExpectFault(Replaced(asf, "    thigh shin\n", ""), kAmc, "not in :hierarchy");
  ExpectFault(Replaced(asf, "root thigh", "shin thigh"), kAmc, "cycle");
  ExpectFault(Replaced(asf, "thigh shin", "thigh foot"), kAmc, "unknown bone");
  ExpectFault(Replaced(asf, "thigh shin", "thigh shin\nroot shin"), kAmc, "two parents");
}

TEST(AsfAmc, MotionFaultsNameTheLine) {
  const std::string amc = kAmc;
  ExpectFault(kAsf, "", "no frames");
  ExpectFault(kAsf, ":FULLY-SPECIFIED\n:DEGREES\n", "no frames");
  ExpectFault(kAsf, Replaced(amc, "shin 90", "shin"), "t.amc:7");
  ExpectFault(kAsf, Replaced(amc, "shin 90", "shin 90 1"), "more than 1 numbers");
  ExpectFault(kAsf, Replaced(amc, "shin 90", "shin inf"), "not finite");
  ExpectFault(kAsf, Replaced(amc, "shin 90", "foot 90"), "lacks");
  ExpectFault(kAsf, Replaced(amc, "shin 90\n", ""), "lacks bone 'shin'");
  ExpectFault(kAsf, Replaced(amc, "shin 90", "thigh 0 0"), "twice");
  ExpectFault(kAsf, Replaced(amc, "1\nroot", "one\nroot"), "frame's number");
}

TEST(AsfAmc, FindsTheSkeletonBesideTheMotion) {
  const TemporaryFolder folder;
  std::ofstream(folder / "07.asf") << kAsf;
  std::ofstream(folder / "07_03.amc") << kAmc;
  EXPECT_EQ(ReadAmc(folder / "07_03.amc").NumFrames(), 2);
  EXPECT_EQ(FindAsfBeside(folder / "other.amc"), folder / "07.asf");  // the only one there
  std::ofstream(folder / "08.asf") << kAsf;
  EXPECT_EQ(FindAsfBeside(folder / "07_03.amc"), folder / "07.asf");
  EXPECT_THROW(FindAsfBeside(folder / "other.amc"), Error);
  const TemporaryFolder empty;
  EXPECT_THAT(testing::ErrorText([&] { FindAsfBeside(empty / "07_03.amc"); }), HasSubstr("--asf"));
}

}  // namespace
}  // namespace holdfast
