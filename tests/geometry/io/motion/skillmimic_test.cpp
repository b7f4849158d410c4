// SPDX-License-Identifier: MIT
#include "geometry/io/motion/skillmimic.h"

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
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

DataValue TableOf(const TemporaryFolder& folder, std::vector<float> values, std::size_t columns) {
  const fs::path path = folder / "table.npz";
  NpzWriter writer;
  const std::size_t rows = values.size() / columns;
  writer.AddFloat32("table", {rows, columns}, std::move(values));
  writer.Write(path);
  return DataFile(path)["table"];
}

std::string FaultOf(const DataValue& table) {
  return testing::ErrorText([&] { ReadSkillMimic(table); });
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
  const SourceMotion motion = ReadSkillMimic(TableOf(folder, frame, kSkillMimicColumns));
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
  EXPECT_FALSE(LooksLikeSkillMimic(TableOf(folder, numbers, 2)));
  EXPECT_TRUE(LooksLikeSkillMimic(TableOf(folder, numbers, kSkillMimicColumns)));
  EXPECT_THAT(FaultOf(TableOf(folder, numbers, 2)), HasSubstr("shape"));
  std::vector<float> broken = numbers;
  broken[kSkillMimicColumns + 5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(FaultOf(TableOf(folder, broken, kSkillMimicColumns)),
              HasSubstr("in frame 1, column 5"));
}

TEST(SkillMimic, PublishedSkeletonIsFoundAgain) {
  const fs::path path = PublishedPickUp();
  std::ifstream text(testing::DataFolder() / "skillmimic" / "skeleton.json");
  if (!text || !fs::exists(path)) GTEST_SKIP() << "no " << path;
  const nlohmann::json joints = nlohmann::json::parse(text)["joints"];
  const SourceMotion motion = ReadSkillMimic(DataFile(path).Root());
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
