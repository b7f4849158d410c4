// SPDX-License-Identifier: MIT
#include "geometry/io/motion/array_motion.h"

#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/import/import_file.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/pickle/data_file.h"
#include "tests/support/data_folder.h"
#include "tests/support/error_text.h"
#include "tests/support/imported.h"
#include "tests/support/npy.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

DataFile TableOf(const TemporaryFolder& folder, const std::vector<float>& values,
                 std::size_t columns) {
  const fs::path path = folder / "table.npy";
  const std::size_t rows = values.size() / columns;
  testing::WriteNpy(path, "(" + std::to_string(rows) + ", " + std::to_string(columns) + ")",
                    values);
  return DataFile(path);
}

std::string FaultOf(const DataFile& table) {
  return testing::ErrorText([&] { ReadArrayMotion(table); });
}

// A take as its authors published it.
fs::path PublishedPickUp() {
  return testing::DataFolder() / "skillmimic" / "pick_40" / "001_007pickle_pick_000.pt";
}

TEST(SkillMimic, WorldAndJointTurnsComeOutYUp) {
  std::vector<float> frame(kSkillMimicColumns, 0.0F);
  frame[2] = 1.0F;                                      // the pelvis a meter high
  frame[3] = frame[6] = std::numbers::pi_v<float> / 2;  // upright: y of the body along z
  for (int j = 0; j < 53; ++j) frame[165 + 3 * j + 2] = 0.1F * static_cast<float>(j);
  frame[9 + 3 * 1 + 2] = 0.5F;  // left knee
  frame[324] = 3.0F;
  frame[326] = 0.12F;
  const TemporaryFolder folder;
  const SourceMotion motion = ReadArrayMotion(TableOf(folder, frame, kSkillMimicColumns));
  ASSERT_EQ(motion.NumFrames(), 1);
  ASSERT_EQ(motion.NumJoints(), 53);
  EXPECT_EQ(motion.frame_rate, 60.0);
  EXPECT_TRUE(motion.positions[0].col(0).isApprox(Eigen::Vector3d(0, 1, 0), 1e-6));
  EXPECT_LT(motion.Rotation(0, 0).angularDistance(Eigen::Quaterniond::Identity()), 1e-6);
  EXPECT_NEAR(motion.Rotation(0, 2).angularDistance(motion.Rotation(0, 1)), 0.5, 1e-6);
  EXPECT_NEAR(motion.rest_offsets.col(1).norm(), 0.1, 1e-6);
  EXPECT_TRUE(motion.prop->positions.col(0).isApprox(Eigen::Vector3d(3, 0.12, 0), 1e-6));
  EXPECT_NEAR(motion.prop->mesh.vertices.colwise().norm().minCoeff(), 0.12, 1e-9);
}

TEST(SkillMimic, OtherTablesAreRefused) {
  const TemporaryFolder folder;
  const std::vector<float> numbers(2 * kSkillMimicColumns, 0.0F);
  EXPECT_FALSE(LooksLikeArrayMotion(TableOf(folder, numbers, 2)));
  EXPECT_TRUE(LooksLikeArrayMotion(TableOf(folder, numbers, kSkillMimicColumns)));
  EXPECT_THAT(FaultOf(TableOf(folder, numbers, 2)), HasSubstr("(T, 337)"));
  std::vector<float> broken = numbers;
  broken[kSkillMimicColumns + 5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(FaultOf(TableOf(folder, broken, kSkillMimicColumns)),
              HasSubstr("in frame 1, column 5"));
}

double JointDistance(const SourceMotion& motion, const Eigen::MatrixXd& places) {
  double most = 0.0;
  for (int t = 0; t < motion.NumFrames(); ++t) {
    most = std::max(most, (motion.positions[t].reshaped() - places.col(t)).norm());
  }
  return most;
}

TEST(InterMimic, TurnedRestPosesAreTheSameMotion) {
  for (const char* name : {"sub1_cup_001", "sub3_largetable_006"}) {
    SCOPED_TRACE(name);
    const fs::path path = testing::Fixture(std::string("hand_sets/") + name + ".pt");
    const SourceMotion motion = ReadArrayMotion(DataFile(path));
    ASSERT_EQ(motion.NumJoints(), 52);
    EXPECT_LT(JointDistance(motion, testing::ExpectedOfSet("intermimic.joints")), 1e-5);
    const Eigen::MatrixXd cube = testing::ExpectedOfSet("cube"),
                          expected = testing::ExpectedOfSet("intermimic.object");
    for (int t = 0; t < motion.NumFrames(); ++t) {
      const Eigen::Matrix3Xd posed =
          (motion.prop->rotations[t].toRotationMatrix() * cube).colwise() +
          motion.prop->positions.col(t);
      EXPECT_LT((posed.reshaped() - expected.col(t)).norm(), 1e-5) << t;
    }
    const ImportedFile imported = ImportFile(path, {});
    EXPECT_LT(imported.motion->retarget.mean_joint_error_mm, 5.0);
    EXPECT_EQ(imported.clip.object->name,
              std::string(name) == "sub1_cup_001" ? "cup" : "largetable");
  }
}

TEST(Kimodo, HasThePositionsOfTheFile) {
  for (const int joints : {77, 30}) {
    SCOPED_TRACE(joints);
    const fs::path path = testing::Fixture("hand_sets/kimodo_" + std::to_string(joints) + ".npz");
    const DataFile file(path);
    const SourceMotion motion = ReadArrayMotion(file);
    ASSERT_EQ(motion.NumJoints(), joints);
    const std::vector<double> numbers = file["posed_joints"].Array().AsDoubles();
    EXPECT_LT(JointDistance(motion, Eigen::Map<const Eigen::MatrixXd>(numbers.data(), 3 * joints,
                                                                      motion.NumFrames())),
              1e-5);
    const ImportedFile imported = ImportFile(path, {});
    EXPECT_TRUE(imported.motion->missing_body_joints.empty());
    EXPECT_LT(imported.motion->retarget.mean_joint_error_mm, 5.0);
  }
  const TemporaryFolder folder;
  NpzWriter writer;
  writer.AddFloat32("posed_joints", {1, 77, 3}, std::vector<float>(231, 0.0F));
  writer.AddFloat32("global_rot_mats", {1, 77, 3, 3}, std::vector<float>(693, 0.0F));
  writer.Write(folder / "zero.npz");
  EXPECT_THAT(FaultOf(DataFile(folder / "zero.npz")), HasSubstr("no rotation in frame 0, joint"));
}

TEST(SkillMimic, PublishedSkeletonIsFoundAgain) {
  const fs::path path = PublishedPickUp();
  std::ifstream text(testing::DataFolder() / "skillmimic" / "skeleton.json");
  if (!text || !fs::exists(path)) GTEST_SKIP() << "no " << path;
  const nlohmann::json joints = nlohmann::json::parse(text)["joints"];
  const SourceMotion motion = ReadArrayMotion(DataFile(path));
  ASSERT_EQ(motion.NumJoints(), static_cast<int>(joints.size()));
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    EXPECT_EQ(motion.joint_names[j], joints[j]["name"]);
    EXPECT_EQ(motion.parents[j], joints[j]["parent"]);
    const std::vector<double> offset = joints[j]["offset"];
    const Eigen::Map<const Eigen::Vector3d> expected(offset.data());
    EXPECT_NEAR(motion.rest_offsets.col(column).norm(), expected.norm(), 1e-4) << joints[j]["name"];
    EXPECT_LT((motion.rest_offsets.col(column) - expected).norm(), 0.25 * expected.norm() + 0.005)
        << joints[j]["name"];
  }
}

TEST(SkillMimic, PublishedFileBecomesAClipWithABall) {
  const fs::path path = PublishedPickUp();
  if (!fs::exists(path)) GTEST_SKIP() << "no " << path;
  const ImportedFile imported = ImportFile(path, {});
  EXPECT_EQ(imported.format, "SkillMimic");
  ASSERT_TRUE(imported.clip.object.has_value());
  EXPECT_EQ(imported.clip.object->name, "ball");
  ASSERT_TRUE(imported.object_surface.has_value());
  EXPECT_EQ(imported.source_frame_rate, 60.0);
  EXPECT_TRUE(imported.motion->missing_body_joints.empty());
  // The ball lies on the ground when nobody has it; the feet say where that is, a few centimeters
  // off.
  const double radius = 0.12 * imported.motion->retarget.scale;
  EXPECT_NEAR(imported.clip.object->trans.row(2).minCoeff(), radius, 0.05);
}

}  // namespace
}  // namespace holdfast
