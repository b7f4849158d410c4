// SPDX-License-Identifier: MIT
#include "generator/imos/face_error.h"

#include <gtest/gtest.h>

#include "geometry/error.h"

namespace holdfast::imos {
namespace {

// Straight to the mouth and back: given at the waist, nearest in column 3.
Eigen::Matrix3Xd ToTheMouth() {
  Eigen::Matrix3Xd places(3, 6);
  places << 0.2, 0.2, 0.1, 0.0, 0.05, 0.2,  //
      -0.7, -0.7, -0.4, -0.05, -0.3, -0.6,  //
      0.2, 0.2, 0.2, 0.15, 0.2, 0.2;
  return places;
}

TEST(FaceError, IsNothingForTheReferenceItself) {
  EXPECT_EQ(FaceError(ToTheMouth(), ToTheMouth(), 2), 0.0);
}

TEST(FaceError, IsHowNearItEverComesWhenever) {
  Eigen::Matrix3Xd late = ToTheMouth();
  late.col(3) = late.col(2);
  late.col(5) = ToTheMouth().col(3) + Eigen::Vector3d(0.0, 0.03, 0.04);  // nose, not mouth
  EXPECT_NEAR(*FaceError(late, ToTheMouth(), 2), 0.05, 1e-12);
  // What was given does not count.
  Eigen::Matrix3Xd never = ToTheMouth();
  for (int t = 2; t < 6; ++t) never.col(t) = never.col(0);
  never.col(0) = ToTheMouth().col(3);
  EXPECT_NEAR(*FaceError(never, ToTheMouth(), 2),
              (ToTheMouth().col(1) - ToTheMouth().col(3)).norm(), 1e-12);
}

TEST(FaceError, IsOfWhatComesToTheFaceAlone) {
  Eigen::Matrix3Xd far = ToTheMouth();
  far.row(2).array() += 0.5;
  EXPECT_FALSE(FaceError(ToTheMouth(), far, 2));
  Eigen::Matrix3Xd there_already = ToTheMouth();
  there_already.col(1) = there_already.col(3) + Eigen::Vector3d(0.0, 0.0, 0.05);
  EXPECT_FALSE(FaceError(ToTheMouth(), there_already, 2));
}

TEST(FaceError, RefusesWhatCannotBeCompared) {
  EXPECT_THROW(FaceError(ToTheMouth(), ToTheMouth().leftCols(5), 2), Error);
  EXPECT_THROW(FaceError(ToTheMouth(), ToTheMouth(), 6), Error);
  EXPECT_THROW(FaceError(ToTheMouth(), ToTheMouth(), 0), Error);
}

}  // namespace
}  // namespace holdfast::imos
