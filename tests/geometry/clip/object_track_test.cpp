// SPDX-License-Identifier: MIT
#include <numbers>

#include <gtest/gtest.h>

#include "geometry/clip/clip.h"
#include "geometry/pose.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// A turn of 0.4 rad a frame, through more than half a circle.
TEST(ObjectTrack, PosesComeBackAndAnglesGoOn) {
  constexpr int kFrames = 12;
  ObjectTrack track;
  track.trans.setZero(3, kFrames);
  track.orient.setZero(3, kFrames);
  const auto pose = [](int t) {
    return RigidTransform(ExpSO3(Eigen::Vector3d(0.0, 0.0, 0.4 * t)),
                          Eigen::Vector3d(t, 2.0, -1.0));
  };
  for (int t = 0; t < kFrames; ++t) track.SetPose(t, pose(t));
  for (int t = 0; t < kFrames; ++t) {
    EXPECT_LT((track.Pose(t).matrix() - pose(t).matrix()).norm(), 1e-12) << t;
    EXPECT_NEAR(track.orient(2, t), 0.4 * t, 1e-9) << t;  // no jump at half a turn
  }
  EXPECT_GT(track.orient(2, kFrames - 1), std::numbers::pi);
}

TEST(ObjectTrack, FirstFrameStaysNearWhatStandsThere) {
  ObjectTrack track;
  track.trans.setZero(3, 1);
  track.orient = Eigen::Vector3d(0.0, 0.0, 6.0);
  track.SetPose(0, RigidTransform(ExpSO3(Eigen::Vector3d(0.0, 0.0, 6.1)), Eigen::Vector3d::Zero()));
  EXPECT_NEAR(track.orient(2, 0), 6.1, 1e-9);
}

}  // namespace
}  // namespace holdfast
