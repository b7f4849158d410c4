// SPDX-License-Identifier: MIT
#include "geometry/score/hand_object_score.h"

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "tests/geometry/mesh_shapes.h"

namespace holdfast {
namespace {

using testing::Box;

const Eigen::Vector3d kLow(-0.1, -0.1, -0.002), kHigh(0.1, 0.1, 0.002);  // a plate of 4 mm

Touch TouchOf(const Eigen::Matrix3Xd& hand, double threshold_m = 0.005) {
  const SignedDistance plate(Box(kLow, kHigh));
  std::vector<SignedDistance::Result> queries;
  for (const auto& point : hand.colwise()) queries.push_back(plate.Query(point));
  return FindTouch(hand, queries, threshold_m);
}

// Three vertices: on the plate, 3 mm above it, and 2 cm above it.
Eigen::Matrix3Xd Hand() {
  Eigen::Matrix3Xd hand(3, 3);
  hand << 0.0, 0.01, 0.02,  //
      0.0, 0.01, 0.0,       //
      0.002, 0.005, 0.022;
  return hand;
}

TEST(ContactTrack, WithinTheThresholdOrInsideIsTouching) {
  EXPECT_EQ(TouchOf(Hand()).vertices, (std::vector<int>{0, 1}));
  Eigen::Matrix3Xd inside = Hand();
  inside(2, 2) = 0.0;  // 2 mm deep
  EXPECT_EQ(TouchOf(inside, 0.001).vertices, (std::vector<int>{0, 2}));
}

TEST(ContactTrack, ARigidCarryNeitherSlipsNorLosesContact) {
  // In the object's frame a rigid carry is no motion at all.
  const std::vector<Touch> frames(5, TouchOf(Hand()));
  const ContactTrack track = TrackContact(frames);
  EXPECT_EQ(track.mean_iou, 1.0);
  EXPECT_EQ(track.mean_slip, 0.0);
  EXPECT_EQ(track.max_slip, 0.0);
  EXPECT_EQ(track.max_drift, 0.0);
  EXPECT_FALSE(track.steps[0].iou.has_value());
}

TEST(ContactTrack, ASlideIsMeasured) {
  std::vector<Touch> frames;
  for (int t = 0; t < 6; ++t) {
    Eigen::Matrix3Xd hand = Hand();
    hand.row(0).array() += 0.0005 * t;
    hand.row(1).array() += 0.0012 * t;
    frames.push_back(TouchOf(hand));
  }
  const ContactTrack track = TrackContact(frames);
  EXPECT_NEAR(*track.mean_slip, 1.3, 1e-9);  // mm per frame
  EXPECT_NEAR(*track.max_slip, 1.3, 1e-9);
  EXPECT_NEAR(*track.mean_drift, 5 * 1.3, 1e-9);
  EXPECT_NEAR(*track.max_drift, 5 * 1.3, 1e-9);
  EXPECT_NEAR(*track.drift_mm[2], 2 * 1.3, 1e-9);
  EXPECT_EQ(track.mean_iou, 1.0);
}

TEST(ContactTrack, PressingInIsNoSlipAndNeitherIsTheOtherSideOfAThinWall) {
  std::vector<Touch> frames;
  for (const double z : {0.003, 0.001, 0.0001, -0.0001, -0.001}) {
    Eigen::Matrix3Xd hand(3, 1);
    hand << 0.03, 0.0, z;  // the nearest side changes between the third frame and the fourth
    frames.push_back(TouchOf(hand));
  }
  const ContactTrack track = TrackContact(frames);
  EXPECT_NEAR(*track.steps[1].slip_mm, 0.0, 1e-9);
  EXPECT_NEAR(*track.steps[2].slip_mm, 0.0, 1e-9);
  EXPECT_NEAR(*track.steps[3].slip_mm, 0.2, 1e-9);  // the vertex's own way, not the wall's 4 mm
}

TEST(ContactTrack, ConsistencyIsTheSharePresentInBoth) {
  Eigen::Matrix3Xd lifted = Hand();
  lifted(2, 0) = 0.1;  // vertex 0 leaves, 1 stays
  Eigen::Matrix3Xd away = Hand();
  away.row(2).array() += 0.1;
  const std::vector<Touch> frames = {TouchOf(Hand()), TouchOf(lifted), TouchOf(away), TouchOf(away),
                                     TouchOf(Hand())};
  const ContactTrack track = TrackContact(frames);
  EXPECT_EQ(track.steps[1].iou, 0.5);
  EXPECT_EQ(track.steps[2].iou, 0.0);
  EXPECT_FALSE(track.steps[3].iou.has_value());  // no contact before nor now
  EXPECT_EQ(track.steps[4].iou, 0.0);
  EXPECT_EQ(track.mean_iou, 0.5 / 3.0);
}

TEST(ContactTrack, ContactBeginsAnewAfterAGapAndAfterFramesThatDoNotCount) {
  Eigen::Matrix3Xd moved = Hand();
  moved.row(0).array() += 0.03;
  Eigen::Matrix3Xd away = Hand();
  away.row(2).array() += 0.1;
  const Touch here = TouchOf(Hand()), there = TouchOf(moved);
  const ContactTrack gap =
      TrackContact(std::vector<Touch>{here, here, TouchOf(away), there, there});
  EXPECT_EQ(gap.max_drift, 0.0);
  const std::vector<std::uint8_t> counts = {1, 1, 0, 1, 1};
  const ContactTrack flagged =
      TrackContact(std::vector<Touch>{here, here, here, there, there}, counts);
  EXPECT_EQ(flagged.max_drift, 0.0);
  EXPECT_EQ(flagged.mean_iou, 1.0);
  EXPECT_FALSE(flagged.steps[3].iou.has_value());
  EXPECT_THROW(TrackContact(std::vector<Touch>{here}, counts), Error);
  EXPECT_FALSE(TrackContact({}).mean_iou.has_value());
}

}  // namespace
}  // namespace holdfast
