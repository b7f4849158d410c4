// SPDX-License-Identifier: MIT
#include "generator/walk_statistics/motion_metrics.h"

#include <gtest/gtest.h>

#include "tests/generator/test_body.h"

namespace holdfast {
namespace {

Clip Standing() {
  Clip clip;
  clip.pose.assign(2, JointPose::Zero());
  clip.trans.setZero(3, 2);
  return clip;
}

TEST(JointError, AShiftIsItselfAndVanishesWhenAligned) {
  const auto body = BodyModel::Default();
  Clip shifted = Standing();
  shifted.trans.colwise() += Eigen::Vector3d(0.03, 0.0, 0.04);
  const auto a = BodyTrajectory(shifted, body, {}), b = BodyTrajectory(Standing(), body, {});
  ASSERT_EQ(a.size(), 2u);
  const JointError error = CompareJoints(a[1], b[1]);
  EXPECT_NEAR(error.global, 50.0, 1e-9);
  EXPECT_NEAR(error.root_aligned, 0.0, 1e-9);
  EXPECT_NEAR(error.right_hand, 0.0, 1e-9);
  EXPECT_NEAR(error.left_hand, 0.0, 1e-9);
}

TEST(JointError, ABentFingerIsTheHandsAlone) {
  const auto body = BodyModel::Default();
  Clip bent = Standing();
  bent.pose[0].col(kRightHandBegin + 2) = Eigen::Vector3d(0, 0, 0.5);  // the index finger's last
  const auto a = BodyTrajectory(bent, body, {}), b = BodyTrajectory(Standing(), body, {});
  const JointError error = CompareJoints(a[0], b[0]);
  EXPECT_NEAR(error.global, 0.0, 1e-9);
  EXPECT_NEAR(error.left_hand, 0.0, 1e-9);
  // Of the 21 points the fingertip alone moves.
  const double way = (a[0].right.col(16) - b[0].right.col(16)).norm();
  EXPECT_GT(way, 0.005);
  EXPECT_NEAR(error.right_hand, 1e3 * way / 21.0, 1e-9);
}

TEST(JointError, FingertipsLieBeyondTheLastJointsAndMirror) {
  const auto body = BodyModel::Default();
  const Eigen::Matrix3Xd joints = body->RestJoints(body->Template());
  const auto right = FingertipVertices(*body, Side::kRight);
  const auto left = FingertipVertices(*body, Side::kLeft);
  for (int finger = 0; finger < 5; ++finger) {
    const Eigen::Vector3d last = joints.col(kRightHandBegin + 3 * finger + 2);
    const Eigen::Vector3d along = last - joints.col(kRightHandBegin + 3 * finger + 1);
    const Eigen::Vector3d tip = body->Template().col(right[finger]);
    EXPECT_GT((tip - last).dot(along.normalized()), 0.01) << finger;
    EXPECT_LT((tip - last).norm(), 0.05) << finger;
    Eigen::Vector3d mirrored = body->Template().col(left[finger]);
    mirrored.x() = 2.0 * joints(0, 0) - mirrored.x();
    EXPECT_LT((tip - mirrored).norm(), 0.004) << finger;
  }
}

}  // namespace
}  // namespace holdfast
