// SPDX-License-Identifier: MIT
#include "solver/body_ik/reach_refit.h"

#include <cmath>

#include <gtest/gtest.h>

#include "generator/walk_statistics/reach_faults.h"
#include "geometry/rotation.h"
#include "tests/generator/test_body.h"

namespace holdfast {
namespace {

constexpr int kFrames = 80;

const Eigen::Matrix3Xd& RestJoints() { return DefaultMeasures().rest_joints; }

// Stands turned by 40 degrees and leans back by `most` about frame 40.
std::vector<BodyFrame> LeansBack(double most) {
  std::vector<BodyFrame> frames(kFrames);
  for (int t = 0; t < kFrames; ++t) {
    BodyFrame& frame = frames[t];
    frame.pelvis.z() = 0.95;
    frame.local[0] = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(90.0 * kDegree, Eigen::Vector3d::UnitX());
    const double bell = std::exp(-0.01 * (t - 40) * (t - 40));
    frame.local[kSpine2] = Eigen::AngleAxisd(-most * bell, Eigen::Vector3d::UnitX());
  }
  return frames;
}

double Lean(const BodyFrame& frame) { return LeanBack(Place(RestJoints(), frame), Yaw(frame)); }

TEST(StraightenTrunk, WhoLeansBackStandsUprightAndLooksTheSameWay) {
  const std::vector<BodyFrame> before = LeansBack(30.0 * kDegree);
  ASSERT_GT(Lean(before[40]), 15.0 * kDegree);
  ASSERT_LT(Lean(before[40]), 26.0 * kDegree);
  std::vector<BodyFrame> after = before;
  StraightenTrunk(RestJoints(), after);
  for (int t = 0; t < kFrames; ++t) {
    const std::size_t at = static_cast<std::size_t>(t);
    EXPECT_LT(Lean(after[at]), 7.0 * kDegree) << t;
    const Eigen::Matrix3d turn = Place(RestJoints(), before[at]).rotation[kHead].transpose() *
                                 Place(RestJoints(), after[at]).rotation[kHead];
    EXPECT_LT(Eigen::AngleAxisd(turn).angle(), 1e-6) << t;
    EXPECT_EQ(after[at].pelvis, before[at].pelvis);
    if (t == 0) continue;
    EXPECT_LT(std::abs(Lean(after[at]) - Lean(after[at - 1])), 2.0 * kDegree) << t;
  }
  for (const std::size_t far : {0, 1, 79}) {
    EXPECT_EQ(after[far].local[kSpine2].coeffs(), before[far].local[kSpine2].coeffs()) << far;
  }
}

TEST(StraightenTrunk, LeavesTheFirstFrameAndWhoDoesNotLeanBack) {
  std::vector<BodyFrame> frames = LeansBack(-40.0 * kDegree);
  const std::vector<BodyFrame> bows = frames;
  StraightenTrunk(RestJoints(), frames);
  EXPECT_EQ(frames[40].local[kSpine2].coeffs(), bows[40].local[kSpine2].coeffs());
  std::vector<BodyFrame> late = LeansBack(40.0 * kDegree);
  late.erase(late.begin(), late.begin() + 40);
  const BodyFrame first = late[0];
  StraightenTrunk(RestJoints(), late);
  EXPECT_EQ(late[0].local[kSpine2].coeffs(), first.local[kSpine2].coeffs());
}

}  // namespace
}  // namespace holdfast
