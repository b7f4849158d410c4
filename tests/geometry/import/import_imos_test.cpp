// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "geometry/import/imos_result.h"
#include "geometry/import/rotation_arrays.h"
#include "geometry/io/pickle/data_file.h"
#include "tests/support/imported.h"

namespace holdfast::testing {
namespace {

// Layouts of section 9's table: samples with axis-angle and with matrices, and the script's own.
const std::filesystem::path kAxisAngle = Fixture("torch/s10_mug_drink_1.npz");
const std::filesystem::path kMatrices = Fixture("torch/s3_mug_offhand_1.npz");
const std::filesystem::path kScript = Fixture("torch/s1_mug_drink_1_0.npz");

// Numbers of a field as the file has them, row-major.
std::vector<double> Raw(const std::filesystem::path& path, const char* dict, const char* name) {
  return DataFile(path)[dict][name].Array().AsDoubles();
}

TEST(ImportImos, ObjectVerticesAreThoseOfTheAuthorsViewer) {
  Eigen::Matrix3Xd vertices = Eigen::Matrix3Xd::Random(3, 20);
  for (const auto& path : {kAxisAngle, kMatrices, kScript}) {
    const ImportedFile imported = Import(path);
    const std::vector<double> orient = Raw(path, "obj_p", "global_orient");
    const std::vector<double> transl = Raw(path, "obj_p", "transl");
    const bool matrices = orient.size() == 15 * 9;
    const Eigen::MatrixXd ours = Posed(vertices, *imported.clip.object);
    // From the fifth frame on the matrices are not rotations, which has no right answer.
    for (int t = 0; t < (matrices ? 4 : 15); ++t) {
      Eigen::Matrix3d R;
      if (matrices) {
        R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&orient[9 * t]);
      } else {
        R = ExpSO3({orient[3 * t], orient[3 * t + 1], orient[3 * t + 2]});
      }
      const Eigen::RowVector3d T(transl[3 * t], transl[3 * t + 1], transl[3 * t + 2]);
      const Eigen::MatrixXd theirs = ((vertices.transpose() * R).rowwise() + T).transpose();
      EXPECT_LT(MaxDifference(ours.middleCols(20 * t, 20), theirs), 1e-5) << path << " frame " << t;
    }
  }
}

TEST(ImportImos, AllLayoutsAreTheSameBody) {
  const Clip a = Import(kAxisAngle).clip, b = Import(kMatrices).clip, c = Import(kScript).clip;
  ASSERT_EQ(a.NumFrames(), 15);
  for (const Clip& other : {b, c}) {
    ASSERT_EQ(other.NumFrames(), 15);
    EXPECT_LT(LargestTurn(Joints(a, 0, 22), Joints(other, 0, 22)), 1e-3);
    EXPECT_LT(LargestTurn(Joints(a, 25, 30), Joints(other, 25, 30)), 1e-3);
    EXPECT_LT(MaxDifference(a.trans, other.trans), 1e-6);
    EXPECT_LT(MaxDifference(a.v_template, other.v_template), 1e-6);
  }
  EXPECT_LT(MaxDifference(a.object->trans, c.object->trans), 1e-6);
  EXPECT_EQ(a.frame_rate, 10);
  EXPECT_EQ(a.object->name, "mug");
  EXPECT_EQ(a.subject, "s10");
  EXPECT_EQ(b.subject, "s3");
  EXPECT_EQ(a.action, "drink");
  EXPECT_EQ(b.action, "offhand");
  EXPECT_EQ(a.gender, "male");
  EXPECT_EQ(c.gender, "female");  // a tensor that holds 2
  EXPECT_GT(a.v_template.cols(), 0);
}

TEST(ImportImos, TheOlderTorchFormatIsTheSame) {
  const Clip a = Import(kAxisAngle).clip;
  const Clip b = Import(Fixture("torch/s10_mug_drink_1_legacy.npz")).clip;
  EXPECT_EQ(Joints(a, 0, kNumJoints), Joints(b, 0, kNumJoints));
  EXPECT_EQ(a.object->orient, b.object->orient);
}

TEST(ImportImos, MatricesThatAreNoRotationsBecomeTheNearestAndAreReported) {
  const ImportedFile imported = Import(kMatrices);
  const RotationDefects& defects = imported.object_defects;
  EXPECT_EQ(defects.matrices, 15);
  EXPECT_EQ(defects.bad, 11);
  EXPECT_EQ(defects.frames, 11);
  EXPECT_EQ(defects.first_frame, 4);
  EXPECT_TRUE(Mentions(imported.notes, "11 of 15 matrices are not rotations"));
  const std::vector<double> numbers = Raw(kMatrices, "obj_p", "global_orient");
  double min_determinant = 1, max_determinant = 1;
  for (int t = 0; t < 15; ++t) {
    const Eigen::Matrix3d M =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&numbers[9 * t]);
    min_determinant = std::min(min_determinant, M.determinant());
    max_determinant = std::max(max_determinant, M.determinant());
    // No rotation is nearer: turning ours any way goes away from the file's (transposed).
    const Eigen::Matrix3d ours = ExpSO3(imported.clip.object->orient.col(t));
    EXPECT_NEAR(ours.determinant(), 1, 1e-12);
    const double distance = (ours - M.transpose()).norm();
    for (int axis = 0; axis < 3; ++axis) {
      for (const double angle : {-0.02, 0.02, 1.0}) {
        const Eigen::Matrix3d turned = ExpSO3(angle * Eigen::Vector3d::Unit(axis)) * ours;
        EXPECT_GE((turned - M.transpose()).norm(), distance - 1e-9);
      }
    }
  }
  EXPECT_NEAR(defects.min_determinant, min_determinant, 1e-9);
  EXPECT_NEAR(defects.max_determinant, max_determinant, 1e-9);
}

TEST(ImportImos, BodyMatricesOfSinglePrecisionAreNoDefect) {
  const ImportedFile imported = Import(kScript);
  EXPECT_EQ(imported.body_defects.matrices, 15 * 55);
  EXPECT_EQ(imported.body_defects.bad, 0);
  EXPECT_FALSE(Mentions(imported.notes, "no rotations"));
}

TEST(ImportImos, TheFloorComesToZeroAndNothingElseChanges) {
  const ImportedFile kept = Import(kAxisAngle);
  const ImportedFile settled = ImportFile(kAxisAngle, {});
  const Eigen::Matrix3Xd moved = settled.clip.trans - kept.clip.trans;
  EXPECT_GT(moved(2, 0), 0.5);  // the origin is at the subject's first place
  EXPECT_LT(moved.topRows(2).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((moved.row(2).array() - moved(2, 0)).abs().maxCoeff(), 1e-12);
  const Eigen::Matrix3Xd object = settled.clip.object->trans - kept.clip.object->trans;
  EXPECT_LT(MaxDifference(object, moved), 1e-12);
  EXPECT_TRUE(Mentions(settled.conventions, "the floor was at"));
}

TEST(ImportImos, FrameRateIsTheUsersToSay) {
  ImportFileOptions options;
  options.parameters.source_frame_rate = 8;
  options.frame_rate = 24;
  const ImportedFile imported = Import(kAxisAngle, options);
  EXPECT_EQ(imported.source_frame_rate, 8);
  EXPECT_EQ(imported.clip.frame_rate, 24);
  EXPECT_EQ(imported.clip.NumFrames(), 14 * 3 + 1);
}

}  // namespace
}  // namespace holdfast::testing
