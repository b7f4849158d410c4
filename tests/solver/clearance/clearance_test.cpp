// SPDX-License-Identifier: MIT
#include "solver/clearance/clearance.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "geometry/object/load_object.h"
#include "geometry/rotation.h"
#include "geometry/score/own_body_score.h"
#include "solver/clearance/arm_spline.h"
#include "solver/clearance/body_meeting.h"
#include "tests/geometry/mesh_shapes.h"
#include "tests/support/numeric_jacobian.h"

namespace holdfast {
namespace {

const BodySurface& Person() {
  static const BodySurface person(BodyModel::Default());
  return person;
}

const TriangleMesh& Apple() {
  static const TriangleMesh apple = LoadObject("apple").mesh;
  return apple;
}

Eigen::Isometry3d Wrist(const Clip& clip, int t, Side side) {
  BodyState state;
  ForwardJoints(Person().RestJoints(), clip.pose[t], clip.trans.col(t), state);
  return state.WorldFromJoint(WristJoint(side));
}

// Two seconds with the arms hanging, the right one with an apple in its palm; for a while it swings
// `inwards` (radians).
Clip Hanging(double inwards) {
  constexpr int kFrames = 60;
  Clip clip;
  clip.trans = Eigen::Vector3d(0.3, 0.1, 0.9).replicate(1, kFrames);
  clip.object.emplace();
  clip.object->trans.setZero(3, kFrames);
  clip.object->orient.setZero(3, kFrames);
  for (int t = 0; t < kFrames; ++t) {
    const double s = std::exp(-0.5 * std::pow((t - 30) / 6.0, 2));
    JointPose pose = JointPose::Zero();
    pose.col(kRightShoulder) << 0.0, 0.1 * std::sin(0.1 * t), 1.0 + s * inwards;
    pose.col(kLeftShoulder) << 0.0, 0.0, -1.0;
    clip.pose.push_back(pose);
    clip.holding_hand.push_back(kHoldsRight);
    Eigen::Isometry3d in_palm = Eigen::Isometry3d::Identity();
    in_palm.translation() << -0.09, -0.06, 0.0;
    clip.object->SetPose(t, Wrist(clip, t, Side::kRight) * in_palm);
  }
  return clip;
}

double MeanAcceleration(const Clip& clip) {
  double sum = 0.0;
  for (int t = 1; t + 1 < clip.NumFrames(); ++t) {
    const auto at = [&](int k) -> Eigen::Vector3d {
      return Wrist(clip, k, Side::kRight).translation();
    };
    sum += (at(t - 1) - 2.0 * at(t) + at(t + 1)).norm();
  }
  return sum;
}

ArmFrame FrameOf(Side side, unsigned seed) {
  std::srand(seed);
  BodyState state;
  ForwardJoints(Person().RestJoints(), 0.5 * JointPose::Random(), Eigen::Vector3d::Random(), state);
  return {Person().RestJoints(), side, state};
}

TEST(ArmState, IsTheBodysForwardModel) {
  std::srand(5);
  JointPose pose = 0.5 * JointPose::Random();
  const ArmChange change = 0.3 * ArmChange::Random();
  const Eigen::Vector3d trans = Eigen::Vector3d::Random();
  for (const Side side : {Side::kRight, Side::kLeft}) {
    BodyState state;
    ForwardJoints(Person().RestJoints(), pose, trans, state);
    ArmState arm;
    arm.Evaluate(ArmFrame(Person().RestJoints(), side, state), change);
    JointPose changed = pose;
    for (int k = 0; k < 4; ++k) {
      auto column = changed.col(JointOfArm(side, k));
      column = LogSO3(ExpSO3(column) * ExpSO3(change.segment<3>(3 * k)));
    }
    ForwardJoints(Person().RestJoints(), changed, trans, state);
    for (int k = 0; k < 4; ++k) {
      EXPECT_TRUE(arm.WorldFrom(k).isApprox(state.WorldFromJoint(JointOfArm(side, k)), 1e-12));
    }
  }
}

TEST(ClearanceBlock, JacobianIsThatOfDifferences) {
  for (unsigned seed = 1; seed < 5; ++seed) {
    const Side side = seed % 2 == 0 ? Side::kRight : Side::kLeft;
    const ArmFrame frame = FrameOf(side, seed);
    ArmState state;
    state.Evaluate(frame, ArmChange::Zero());
    DepthInBody depth;
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector3d normal = Eigen::Vector3d::Random().normalized();
      const Eigen::Vector3d in_wrist = 0.1 * Eigen::Vector3d::Random();
      const Eigen::Vector3d at = state.WorldFrom(kArmWrist) * in_wrist;
      depth.planes.push_back({state.WorldFrom(kArmElbow).inverse() * at, in_wrist,
                              i % 3 == 0 ? 1.0 : 0.08 * i, at + 0.3 * normal, normal});
      if (i % 4 == 0) depth.planes.back().surface -= 2.0 * normal;  // clear
    }
    HandStay stay;
    stay.wrist = state.WorldFrom(kArmWrist);
    ArmRange range(side, frame);
    stay.sigma_rad << 0.1, 0.2, 0.3;
    stay.most_m = 0.05;
    stay.most_rad = 0.1;
    range.lowest.array() += seed % 2 == 0 ? 0.5 : -0.5;
    range.highest.array() += seed % 2 == 0 ? 0.7 : -0.5;
    const ClearanceBlock block(frame, depth, stay, range, {0.1, 0.4, 0.3, 0.2});
    std::array<ArmChange, 4> knots;
    std::vector<double*> blocks;
    for (ArmChange& knot : knots) {
      knot = 0.4 * ArmChange::Random();
      blocks.push_back(knot.data());
    }
    EXPECT_LT(testing::JacobianError(block, blocks), 1e-5) << seed;
  }
}

TEST(ClearanceBlock, IsZeroForTheClipsOwnArmThatIsClear) {
  const ArmFrame frame = FrameOf(Side::kRight, 9);
  ArmState state;
  state.Evaluate(frame, ArmChange::Zero());
  HandStay stay;
  stay.wrist = state.WorldFrom(kArmWrist);
  const Eigen::Vector3d at = stay.wrist.translation();
  DepthInBody depth;
  depth.planes.push_back({Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 1.0,
                          at - 0.01 * Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitX()});
  const ClearanceBlock block(frame, depth, stay, ArmRange(Side::kRight, frame),
                             Eigen::Vector4d::Constant(0.25));
  ArmChange zero = ArmChange::Zero();
  const Eigen::VectorXd residuals =
      testing::ResidualsAt(block, {zero.data(), zero.data(), zero.data(), zero.data()});
  EXPECT_LT(residuals.cwiseAbs().maxCoeff(), 1e-9);
}

TEST(ClosureBlock, IsZeroForTheClipAndItsJacobianThatOfDifferences) {
  const ArmFrame right = FrameOf(Side::kRight, 3), left = FrameOf(Side::kLeft, 3);
  ArmState r, l;
  r.Evaluate(right, ArmChange::Zero());
  l.Evaluate(left, ArmChange::Zero());
  HandClosure closure;
  closure.right_from_left = r.WorldFrom(kArmWrist).inverse() * l.WorldFrom(kArmWrist);
  const ClosureBlock block(right, left, closure, {0.1, 0.4, 0.3, 0.2});
  std::array<ArmChange, 8> knots;
  std::vector<double*> blocks;
  for (ArmChange& knot : knots) {
    knot.setZero();
    blocks.push_back(knot.data());
  }
  const Eigen::VectorXd residuals = testing::ResidualsAt(block, blocks.data());
  EXPECT_LT(residuals.cwiseAbs().maxCoeff(), 1e-9);
  for (ArmChange& knot : knots) knot = 0.3 * ArmChange::Random();
  EXPECT_LT(testing::JacobianError(block, blocks), 1e-5);
}

TEST(ArmSpline, PriorsJacobianIsThatOfDifferencesAndTheBasisSumsToOne) {
  const ArmSplinePrior prior(ArmChange::Constant(0.1), 0.5);
  std::array<ArmChange, 3> knots = {ArmChange::Random(), ArmChange::Random(), ArmChange::Random()};
  EXPECT_LT(testing::JacobianError(prior, {knots[0].data(), knots[1].data(), knots[2].data()}),
            1e-6);
  const ArmSpline spline(31, 6.0);
  for (int t = 0; t < 31; ++t) {
    const auto [knot, basis] = spline.Place(t);
    EXPECT_NEAR(basis.sum(), 1.0, 1e-12);
    EXPECT_GE(basis.minCoeff(), 0.0);
    EXPECT_LE(knot + 4, spline.Size());
  }
}

TEST(KeepOutOfBody, AnArmThatSwingsThroughTheHipGivesWay) {
  const Clip before = Hanging(0.45);
  Clip clip = before;
  const ClearanceReport report = KeepOutOfBody(Person(), Apple(), {}, clip);
  EXPECT_TRUE(report.moved);
  EXPECT_GT(report.deep_before, 5);
  EXPECT_GT(report.worst_before_m, 0.02);
  EXPECT_EQ(report.deep, 0);
  EXPECT_LT(report.shift_max_m, 0.12);
  EXPECT_LT(MeanAcceleration(clip), 1.1 * MeanAcceleration(before));
  EXPECT_EQ(clip.trans, before.trans);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    for (int j = 0; j < kNumJoints; ++j) {
      const bool arm =
          j == kRightCollar || j == kRightShoulder || j == kRightElbow || j == kRightWrist;
      EXPECT_TRUE(arm || clip.pose[t].col(j) == before.pose[t].col(j)) << t << ' ' << j;
    }
    // The hold stays what it was.
    const Eigen::Isometry3d was = Wrist(before, t, Side::kRight).inverse() * before.object->Pose(t);
    const Eigen::Isometry3d is = Wrist(clip, t, Side::kRight).inverse() * clip.object->Pose(t);
    EXPECT_TRUE(is.isApprox(was, 1e-9)) << t;
  }
  // Depths are judged as the score does.
  const auto score = MeasureOwnBody(clip, Person(), &Apple(), kHoldsRight);
  ASSERT_TRUE(score);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    EXPECT_EQ(1e3 * report.frames[t].depth_m,
              1e3 * (1e-3 * std::max(score->object->depth_mm[t], score->arms.depth_mm[t])))
        << t;
  }
  // What comes out is clear, and stays as it is.
  const Clip clear = clip;
  EXPECT_FALSE(KeepOutOfBody(Person(), Apple(), {}, clip).moved);
  EXPECT_EQ(clip.pose, clear.pose);
}

TEST(KeepOutOfBody, MovesTheArmThatDoesNotHoldToo) {
  Clip before = Hanging(0.0);
  for (int t = 0; t < before.NumFrames(); ++t) {
    before.pose[t].col(kLeftShoulder).z() -= 0.7 * std::exp(-0.5 * std::pow((t - 30) / 6.0, 2));
  }
  Clip clip = before;
  const ClearanceReport report = KeepOutOfBody(Person(), Apple(), {}, clip);
  ASSERT_TRUE(report.moved);
  EXPECT_GT(report.deep_before, 5);
  EXPECT_EQ(report.deep, 0);
  EXPECT_EQ(report.shift_max_m, 0.0);
  EXPECT_GT(report.free_shift_max_m, 0.005);
  EXPECT_GT(report.free_shift_max_m, report.free_shift_mean_m);
  EXPECT_EQ(clip.object->trans, before.object->trans);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    EXPECT_EQ(clip.pose[t].col(kRightShoulder), before.pose[t].col(kRightShoulder)) << t;
  }
}

// Adds a table whose top is 3 cm above the lowest point of the hanging right hand; the person
// stands along y.
void AddTableUnderHand(Clip& clip) {
  double lowest = 1e9;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    BodyState state;
    Forward(Person(), clip.pose[t], clip.trans.col(t), state);
    for (const int i : OwnBody::ForearmAndHand(Person(), Side::kRight)) {
      lowest = std::min(lowest, state.vertices(1, i));
    }
  }
  ObjectTrack table;
  table.surface = std::make_shared<const TriangleMesh>(
      testing::Box({-0.4, -0.4, -0.03}, Eigen::Vector3d(0.4, 0.4, 0.0)));
  const Eigen::Vector3d wrist = Wrist(clip, 0, Side::kRight).translation();
  table.trans =
      Eigen::Vector3d(wrist.x() - 0.3, lowest + 0.03, wrist.z()).replicate(1, clip.NumFrames());
  table.orient = (-90.0 * kDegree * Eigen::Vector3d::UnitX()).replicate(1, clip.NumFrames());
  clip.table = table;
}

TEST(KeepOutOfBody, KeepsHandAndObjectOutOfATable) {
  Clip clip = Hanging(0.0);
  AddTableUnderHand(clip);
  const auto deepest = [&] {
    const auto score = MeasureOwnBody(clip, Person(), &Apple(), kHoldsRight);
    return std::max(score->arms_in_table->max_mm, score->object_in_table->max_mm);
  };
  EXPECT_GT(deepest(), 14.0);  // half of its thickness
  Clip kept = clip;
  const ClearanceReport measured = KeepOutOfBody(Person(), Apple(), {.keep_motion = true}, kept);
  EXPECT_TRUE(measured.worst_in_table);
  EXPECT_NE(ClearanceWarnings(measured).at(0).find("penetrates the table"), std::string::npos);
  const ClearanceReport report = KeepOutOfBody(Person(), Apple(), {}, clip);
  ASSERT_TRUE(report.moved);
  EXPECT_EQ(report.deep, 0);
  EXPECT_LT(deepest(), 2.0);
  EXPECT_GT(report.shift_max_m, 0.02);
}

// A box stands 1 mm in front of the hand, which moves through it unless it knows the box.
TEST(KeepOutOfBody, AFreeHandLeavesATableBesideTheObject) {
  const Clip hanging = [] {
    Clip clip = Hanging(0.0);
    clip.holding_hand.assign(clip.pose.size(), 0);
    AddTableUnderHand(clip);
    return clip;
  }();
  const TriangleMesh box = testing::Box({-0.05, -0.05, -0.05}, Eigen::Vector3d(0.05, 0.05, 0.05));
  const DistanceGrid distance{SignedDistance(box)};
  Clip stands = hanging;
  stands.object->orient.setZero();
  const auto in_box = [&](const Clip& clip) {
    double deepest = 0.0;
    for (int t = 0; t < clip.NumFrames(); ++t) {
      BodyState state;
      Forward(Person(), clip.pose[t], clip.trans.col(t), state);
      for (const int i : OwnBody::ForearmAndHand(Person(), Side::kRight)) {
        const Eigen::Vector3d at =
            clip.object->Pose(t).inverse() * Eigen::Vector3d(state.vertices.col(i));
        deepest = std::max(deepest, -distance.Distance(at));
      }
    }
    return deepest;
  };
  stands.object->trans =
      (Wrist(hanging, 0, Side::kRight).translation() + Eigen::Vector3d(0.0, 0.0, 0.3))
          .replicate(1, stands.NumFrames());
  while (in_box(stands) == 0.0) stands.object->trans.row(2).array() -= 0.001;
  stands.object->trans.row(2).array() += 0.002;
  const auto keep_out = [&](bool know_object) {
    Clip clip = stands;
    ClearanceScene scene(Person(), box, clip.holding_hand, clip.frame_rate);
    if (know_object) scene.meeting.AddObject(distance, false);
    const ClearanceReport report = KeepOutOfBody(Person(), box, {}, scene, clip);
    EXPECT_TRUE(report.moved);
    EXPECT_EQ(report.deep, 0);
    return in_box(clip);
  };
  EXPECT_GT(keep_out(false), 0.004);
  EXPECT_LT(keep_out(true), 0.001);
}

TEST(KeepOutOfBody, IsTheSameWithASceneMadeBeforeForAnyThreads) {
  const Clip before = Hanging(0.45);
  const ClearanceScene scene(Person(), Apple(), before.holding_hand, before.frame_rate);
  Clip once = before;
  const ClearanceReport expected = KeepOutOfBody(Person(), Apple(), {}, once);
  ASSERT_TRUE(expected.moved);
  for (const int threads : {1, 3}) {
    Clip clip = before;
    ClearanceOptions options;
    options.threads = threads;
    const ClearanceReport report = KeepOutOfBody(Person(), Apple(), options, scene, clip);
    EXPECT_EQ(clip.pose, once.pose) << threads;
    EXPECT_EQ(clip.object->trans, once.object->trans) << threads;
    EXPECT_EQ(report.worst_before_m, expected.worst_before_m) << threads;
  }
}

TEST(BodyCollisionDetector, LooksAtOtherPointsAsIfMadeForThem) {
  constexpr double kFine_m = 0.005;
  const Clip clip = Hanging(0.45);
  const std::uint8_t held = kHoldsRight;
  BodyCollisionDetector meeting(Person(), Apple(), {&held, 1});
  const BodyCollisionDetector fine(Person(), Apple(), {&held, 1}, kFine_m);
  BodyState state;
  Forward(Person(), clip.pose[30], clip.trans.col(30), state);
  const auto measured = [&](const BodyCollisionDetector& by) {
    return by.Measure(state, clip.object->Pose(30), kHoldsRight, kHoldsRight, 0.02);
  };
  const std::size_t coarse = measured(meeting).near[0].size();
  meeting.LookAt(Apple(), kFine_m);
  const BodyCollisionDetector::Frame frame = measured(meeting), expected = measured(fine);
  EXPECT_GT(frame.near[0].size(), coarse);
  ASSERT_EQ(frame.near[0].size(), expected.near[0].size());
  EXPECT_EQ(frame.depth_m, expected.depth_m);
  EXPECT_EQ(frame.near[0].back().at, expected.near[0].back().at);
}

TEST(BodyCollisionDetector, FindsTheDeepestOfAllItsPoints) {
  const Clip clip = Hanging(0.45);
  const std::uint8_t held = kHoldsRight;
  const BodyCollisionDetector meeting(Person(), Apple(), {&held, 1});
  const OwnBody obstacle(Person(), kHoldsRight);
  for (int t = 28; t <= 32; t += 2) {
    BodyState state;
    Forward(Person(), clip.pose[t], clip.trans.col(t), state);
    const BodyCollisionDetector::Frame frame =
        meeting.Measure(state, clip.object->Pose(t), kHoldsRight, kHoldsRight, 0.02);
    double deepest = 0.0;
    for (const BodyCollisionDetector::Point& point : frame.near[0]) {
      const OwnBody::Posed around(obstacle, state.vertices, point.at, point.at);
      const auto touch = around.Query(point.at);
      ASSERT_TRUE(touch);
      EXPECT_NEAR(touch->depth, point.touch.depth, 1e-9);
      deepest = std::max(deepest, touch->depth);
    }
    EXPECT_NEAR(frame.arm_depth_m[0], deepest, 1e-9) << t;
    EXPECT_NEAR(frame.nearest_m, deepest, 1e-9) << t;
    EXPECT_GT(deepest, 0.0) << t;
  }
}

TEST(KeepOutOfBody, AClearClipKeepsItsBits) {
  const Clip before = Hanging(0.0);
  Clip clip = before;
  const ClearanceReport report = KeepOutOfBody(Person(), Apple(), {}, clip);
  EXPECT_FALSE(report.moved);
  EXPECT_EQ(report.deep, 0);
  EXPECT_EQ(report.held_frames, clip.NumFrames());
  EXPECT_EQ(clip.pose, before.pose);
  EXPECT_EQ(clip.object->trans, before.object->trans);
  EXPECT_EQ(clip.object->orient, before.object->orient);
}

TEST(KeepOutOfBody, KeepMotionOnlyMeasures) {
  const Clip before = Hanging(0.45);
  Clip clip = before;
  ClearanceOptions options;
  options.keep_motion = true;
  const ClearanceReport report = KeepOutOfBody(Person(), Apple(), options, clip);
  EXPECT_FALSE(report.moved);
  EXPECT_GT(report.deep, 5);
  EXPECT_EQ(report.deep, report.deep_before);
  EXPECT_NEAR(report.worst_frame, 30, 8);
  EXPECT_NE(report.worst_part, MeetingPart::kNone);
  EXPECT_EQ(clip.pose, before.pose);
}

TEST(KeepOutOfBody, AnObjectThatNobodyHoldsStaysWhereItIs) {
  Clip before = Hanging(0.45);
  for (int t = 0; t < 20; ++t) before.holding_hand[t] = 0;
  Clip clip = before;
  ClearanceOptions options;
  options.threads = 2;
  const ClearanceReport report = KeepOutOfBody(Person(), Apple(), options, clip);
  EXPECT_TRUE(report.moved);
  EXPECT_LT(report.deep, report.deep_before);
  for (const int t : {19, 20}) EXPECT_EQ(clip.pose[t], before.pose[t]) << t;
  for (int t = 0; t <= 20; ++t) {
    EXPECT_EQ(clip.object->trans.col(t), before.object->trans.col(t)) << t;
  }
}

TEST(KeepOutOfBody, TwoHandsKeepTheirPlacesOnTheObject) {
  Clip before = Hanging(0.45);
  for (int t = 0; t < before.NumFrames(); ++t) {
    before.pose[t].col(kLeftElbow) << 0.0, -0.5, 0.0;
    before.holding_hand[t] = kHoldsRight | kHoldsLeft;
    before.object->SetPose(
        t, Wrist(before, t, Side::kRight) * Eigen::Translation3d(-0.09, -0.06, 0.0));
  }
  Clip clip = before;
  const ClearanceReport report = KeepOutOfBody(Person(), Apple(), {}, clip);
  ASSERT_TRUE(report.moved);
  EXPECT_LT(report.deep, report.deep_before);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    for (const Side side : {Side::kRight, Side::kLeft}) {
      const Eigen::Isometry3d was = Wrist(before, t, side).inverse() * before.object->Pose(t);
      const Eigen::Isometry3d is = Wrist(clip, t, side).inverse() * clip.object->Pose(t);
      EXPECT_LT((is.translation() - was.translation()).norm(), 1e-4) << t;
      EXPECT_LT(AngleBetween(is.linear(), was.linear()), 1e-4) << t;
    }
  }
}

TEST(KeepOutOfBody, WantsToKnowWhoHolds) {
  Clip clip = Hanging(0.0);
  clip.holding_hand.clear();
  EXPECT_THROW(KeepOutOfBody(Person(), Apple(), {}, clip), Error);
  clip.object.reset();
  EXPECT_FALSE(KeepOutOfBody(Person(), Apple(), {}, clip).moved);
}

}  // namespace
}  // namespace holdfast
