// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "generator/scripted/reach_motion.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/rotation.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/grasp/hand_approach.h"
#include "solver/take/take_path.h"
#include "solver/take/take_table.h"
#include "tests/generator/test_body.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

const Eigen::Matrix3Xd& Rest() { return DefaultMeasures().rest_joints; }

// A chest upright in the world that faces -y, as people in clips do.
const Matrix3d kChest = (Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();

// The hand before the right shoulder, fingers ahead, palm to the left.
ArmTarget InFront(const Vector3d& from_shoulder) {
  ArmTarget target;
  target.shoulder = Vector3d(-0.2, 0.0, 1.4);
  target.chest = kChest;
  target.wrist.translation() = target.shoulder + from_shoulder;
  target.wrist.linear() =
      HandOrientation(Side::kRight, -Vector3d::UnitY(), Vector3d(0.0, 0.0, 1.0));
  return target;
}

// Where the bones of a choice end up, by forward kinematics.
Isometry3d WristOf(const ArmIk& arm, const ArmTarget& target, const ArmChoice& choice) {
  const Limb& limb = arm.Bones();
  const Vector3d elbow =
      target.shoulder + choice.limb.upper * (Rest().col(limb.middle) - Rest().col(limb.root));
  Isometry3d wrist = Isometry3d::Identity();
  wrist.translation() =
      elbow + choice.wrist.lower * (Rest().col(limb.end) - Rest().col(limb.middle));
  wrist.linear() = choice.wrist.lower * choice.wrist.wrist;
  return wrist;
}

TEST(ArmIk, PutsTheHandWhereItIsAsked) {
  const ArmIk arm(Rest(), Side::kRight);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int k = 0; k < 50; ++k) {
    ArmTarget target =
        InFront(Vector3d(0.05 + 0.1 * unit(random), -0.33 + 0.1 * unit(random), -0.2));
    target.wrist.linear() =
        target.wrist.linear() * ExpSO3(0.3 * Vector3d(unit(random), unit(random), unit(random)));
    const ArmChoice best = arm.Best(target);
    const Isometry3d wrist = WristOf(arm, target, best);
    EXPECT_LT((wrist.translation() - target.wrist.translation()).norm(), 1e-9);
    EXPECT_NEAR(AngleBetween(wrist.linear(), target.wrist.linear()), best.hand_error_rad, 1e-7);
    for (int s = -40; s <= 100; s += 5) {
      EXPECT_LT(best.discomfort, arm.At(target, s * kDegree).discomfort + 0.05) << s;
    }
  }
}

TEST(ArmIk, SaysWhatItLacks) {
  const ArmIk arm(Rest(), Side::kRight);
  const double beyond = 0.07;
  const ArmChoice choice = arm.At(InFront(Vector3d(0.0, -(arm.Length() + beyond), 0.0)), 0.0);
  EXPECT_NEAR(choice.shortfall_m, beyond, 1e-9);
  ArmTarget twisted = InFront(Vector3d(0.0, -0.35, -0.2));
  twisted.wrist.linear() = HandOrientation(Side::kRight, Vector3d::UnitY(), Vector3d::UnitX());
  EXPECT_GT(arm.Best(twisted).hand_error_rad, 20.0 * kDegree);
}

TEST(ArmIk, TurnsSmoothlyAlongATrack) {
  const ArmIk arm(Rest(), Side::kRight);
  std::vector<ArmTarget> targets;
  for (int t = 0; t < 60; ++t) {
    const double s = t / 59.0;
    ArmTarget target = InFront(Vector3d(0.3 * s - 0.1, -0.35, -0.35 + 0.4 * s));
    target.wrist.linear() = target.wrist.linear() * ExpSO3(Vector3d(0.6 * s, 0.0, 0.4 * s));
    targets.push_back(target);
  }
  const std::vector<double> swivels = arm.Track(targets, 30.0);
  ASSERT_EQ(swivels.size(), targets.size());
  double mean = 0.0, free = 0.0;
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const double before = swivels[t == 0 ? 0 : t - 1];
    EXPECT_LT(std::abs(swivels[t] - before), 6.0 * kDegree) << t;
    mean += arm.At(targets[t], swivels[t]).discomfort / 60.0;
    free += arm.Best(targets[t]).discomfort / 60.0;
  }
  EXPECT_LT(mean, free + 0.5);
  EXPECT_EQ(swivels, arm.Track(targets, 30.0));
}

TEST(SideTable, MeshIsTheSolidThatDistanceMeasures) {
  const SideTable table = TableAt({0.4, -0.3, 0.72}, 0.7, 0.1, 0.05);
  TriangleMesh mesh = table.Mesh();
  // Top, column and foot: closed, faces outwards.
  const double top = 0.45 * 0.45 * 0.03, column = kPi * 0.025 * 0.025 * 0.67;
  EXPECT_NEAR(SignedVolume(mesh), top + column + kPi * 0.15 * 0.15 * 0.02, 5e-5);
  mesh.vertices = table.world_from_table * mesh.vertices;
  EXPECT_NEAR(mesh.vertices.row(2).maxCoeff(), 0.72, 1e-12);
  EXPECT_NEAR(mesh.vertices.row(2).minCoeff(), 0.0, 1e-12);
  const SignedDistance exact(mesh);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int outside = 0;
  for (int k = 0; k < 500; ++k) {
    const Vector3d p = Vector3d(0.4, -0.3, 0.4) +
                       Vector3d(0.5 * unit(random), 0.5 * unit(random), 0.5 * unit(random));
    const double distance = table.Distance(p);
    if (distance > 0.0) {
      EXPECT_NEAR(distance, exact.Distance(p), 1e-3);  // round parts have 32 sides
      ++outside;
    } else if (distance < -1e-3) {
      EXPECT_LT(exact.Distance(p), 0.0);
    }
  }
  EXPECT_GT(outside, 300);
}

TEST(SideTable, StandsWhereTheObjectIsOnIt) {
  const Vector3d place(1.0, 2.0, 0.6);
  const SideTable table = TableAt(place, 0.5 * kPi, 0.08);
  EXPECT_NEAR(table.Distance(place), 0.0, 1e-12);
  // The edge that faces a person who looks along +y is 8 cm nearer.
  EXPECT_NEAR(table.Distance(place - Vector3d(0.0, 0.1, 0.0)), 0.02, 1e-9);
  EXPECT_LT(table.Distance(place - Vector3d(0.0, 0.07, 0.01)), 0.0);
}

TEST(PlaceTable, KeepsClearOfWhereABodyPasses) {
  const Vector3d place(0.0, 0.0, 0.75);
  // Legs and hips that come within 6 cm of the object from the left: the plain table is in them.
  Eigen::Matrix3Xd body(3, 4000);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (auto p : body.colwise()) {
    p = Vector3d(-0.5 + 0.6 * unit(random), 0.06 + 0.3 * unit(random), 0.75 * unit(random));
  }
  const auto deepest = [&](const SideTable& table) {
    double least = 1.0;
    for (const auto p : body.colwise()) least = std::min(least, table.Distance(Vector3d(p)));
    return std::max(0.0, -least);
  };
  constexpr double kMargin = 0.05;
  EXPECT_GT(deepest(TableAt(place, 0.0, kMargin)), 0.01);
  const TablePlacement placed = PlaceTable(place, 0.0, kMargin, body);
  EXPECT_EQ(placed.deepest_m, 0.0);
  EXPECT_EQ(deepest(placed.table), 0.0);
  const Vector3d on = placed.table.world_from_table.inverse() * place;
  EXPECT_LT(on.head<2>().cwiseAbs().maxCoeff(), 0.225 - kMargin + 1e-9);
  EXPECT_NEAR(on.z(), 0.0, 1e-12);
  // With nobody about it stands as plainly as it can.
  const TablePlacement plain = PlaceTable(place, 0.3, kMargin, Eigen::Matrix3Xd(3, 0));
  EXPECT_TRUE(
      plain.table.world_from_table.isApprox(TableAt(place, 0.3, kMargin).world_from_table, 1e-12));
}

TEST(HandApproach, ComesToAGraspWithoutTouching) {
  const TriangleMesh mesh = ReadMesh(HOLDFAST_MESHES_DIR "/objects/cylinder.ply");
  const SignedDistance surface(mesh);
  const DistanceGrid grid(surface, {.cell_m = 0.0025, .threads = 2});
  const HandModel hand(BodyModel::Default(), {}, Side::kRight);
  const HandAnatomy anatomy(hand);
  GraspOptions options;
  options.oppositions = 24;
  options.closings = 60;
  options.refinements = 12;
  options.threads = 2;
  const Grasp grasp = CloseHand(hand, mesh, surface, grid, options);
  const HandApproach approach = FindApproach(anatomy, grasp, grid, mesh.vertices.row(2).minCoeff());
  EXPECT_LT((ClosingFingers(approach, grasp, 1.0) - grasp.fingers).norm(), 1e-12);
  EXPECT_EQ(ClosingFingers(approach, grasp, 0.0), approach.ready);
  EXPECT_NEAR(approach.retreat.norm(), 1.0, 1e-12);
  EXPECT_LT(approach.through_mm, 1.0);
  // By exact distances, between the places that the search looked at too.
  HandEvaluation evaluation = AtWrist(hand);
  const auto deepest = [&](const FingerPose& fingers, double back) {
    Eigen::Matrix3Xd skin =
        grasp.wrist_from_object.inverse() * evaluation.At(fingers.data(), false).Vertices();
    skin.colwise() += back * approach.retreat;
    return -surface.Distances(skin).minCoeff();
  };
  const double own = std::max(0.0, deepest(grasp.fingers, 0.0));
  for (double back = 0.0; back <= approach.standoff_m; back += 0.005) {
    EXPECT_LT(deepest(approach.ready, back), own + 0.002) << back;
  }
  for (double share = 0.0; share <= 1.0; share += 0.1) {
    EXPECT_LT(deepest(ClosingFingers(approach, grasp, share), 0.0), own + 0.002) << share;
  }
  EXPECT_LT(deepest(approach.ready, approach.standoff_m), -0.015) << "the line begins too near";
}

// A body that comes from 1 m away, is at its place at frame 40 and goes on at once.
std::vector<BodyFrame> Passing() {
  std::vector<BodyFrame> frames(81);
  for (int t = 0; t <= 80; ++t) {
    frames[t].pelvis = Vector3d(0.0, 0.025 * (t - 40), 0.95);
    frames[t].local[0] = Eigen::Quaterniond(kChest);
  }
  return frames;
}

TEST(GiveTime, SlowsWhoPassesAndLeavesWhoStays) {
  std::vector<BodyFrame> frames = Passing();
  std::vector<int> reached = {40, 75};
  GiveTime(Rest(), 17, 40, 30.0, frames, reached);
  const auto before = Passing();
  EXPECT_GT(frames.size(), before.size() + 10);
  EXPECT_EQ(frames.front().pelvis, before.front().pelvis);
  EXPECT_LT((frames.back().pelvis - before.back().pelvis).norm(), 0.03);
  EXPECT_LT(std::abs(frames[reached[0]].pelvis.y()), 0.01);
  EXPECT_NEAR(frames[reached[1]].pelvis.y(), before[75].pelvis.y(), 0.02);
  double slowest = 1.0;
  for (std::size_t t = 1; t < frames.size(); ++t) {
    const double step = (frames[t].pelvis - frames[t - 1].pelvis).norm();
    slowest = std::min(slowest, step);
    EXPECT_LT(step, 0.0251);
  }
  EXPECT_LT(slowest, 0.3 * 0.025);

  std::vector<BodyFrame> staying(60, before[40]);
  std::vector<int> at = {30};
  GiveTime(Rest(), 17, 30, 30.0, staying, at);
  EXPECT_EQ(staying.size(), 60u);
  EXPECT_EQ(at, std::vector<int>{30});
}

TEST(ObjectWay, StandsIsLiftedCarriedAndBrought) {
  const std::vector<BodyFrame> frames = Passing();
  const std::vector<BodyPlacement> body = Place(Rest(), frames);
  const std::vector<Isometry3d> carry_frames = CarryFrames(body, 30.0);
  TakeTimes times;
  times.take = 20;
  times.goals = {65};
  const UprightPose standing{{-0.2, -0.9, 0.8}, 3.0};
  const UprightPose carry{{0.35, -0.15, -0.1}, 0.4};
  const UprightPose goal{{-0.1, 0.3, 1.1}, -2.5};
  const std::vector<Isometry3d> way =
      ObjectWay(times, standing, carry, {&goal, 1}, carry_frames, 30.0);
  ASSERT_EQ(way.size(), frames.size());
  for (int t = 0; t <= times.take; ++t) {
    EXPECT_TRUE(way[t].isApprox(standing.Transform(), 1e-12)) << t;
  }
  EXPECT_LT((way[65].translation() - goal.position).norm(), 1e-12);
  EXPECT_LT(AngleBetween(way[65].linear(), goal.Transform().linear()), 1e-9);
  for (std::size_t t = 1; t < way.size(); ++t) {
    EXPECT_NEAR(way[t].linear()(2, 2), 1.0, 1e-12);
    EXPECT_LT((way[t].translation() - way[t - 1].translation()).norm(), 0.1) << t;
    EXPECT_LT(AngleBetween(way[t].linear(), way[t - 1].linear()), 12.0 * kDegree) << t;
    if (t >= 30) continue;
    EXPECT_GE(way[t].translation().z(), standing.position.z() - 1e-12);
  }
}

// Who does not walk away at once carries lower than the table is high.
TEST(ObjectWay, IsLowOnlyWhereTheObjectIsOffItsPlace) {
  const std::vector<BodyPlacement> body(80, Place(Rest(), Passing().front()));
  const std::vector<Isometry3d> carry_frames = CarryFrames(body, 30.0);
  TakeTimes times;
  times.take = 20;
  const UprightPose standing{{-0.2, -0.9, 0.8}, 3.0};
  const auto carried = [&](double away) {
    const Vector3d place = standing.position + Vector3d(away, 0.0, -0.2);
    const UprightPose carry{carry_frames.front().inverse() * place, 0.4};
    return ObjectWay(times, standing, carry, {}, carry_frames, 30.0);
  };
  EXPECT_NEAR(carried(0.08).back().translation().z(), 0.86, 1e-9);
  const std::vector<Isometry3d> way = carried(0.5);
  for (const Isometry3d& pose : way) {
    const double away = (pose.translation() - standing.position).head<2>().norm();
    EXPECT_TRUE(away > 0.12 || pose.translation().z() > 0.8 - 1e-12) << away;
  }
  EXPECT_NEAR(way.back().translation().z(), 0.6, 1e-9);
}

TEST(TimesOfTake, RefusesFramesThatAreNone) {
  const ArmIk arm(Rest(), Side::kRight);
  const std::vector<BodyPlacement> body = Place(Rest(), Passing());
  const Vector3d wrist(-0.2, -0.4, 1.1);
  for (const std::vector<int>& reached : {std::vector<int>{}, std::vector<int>{5},
                                          std::vector<int>{60, 40}, std::vector<int>{40, 81}}) {
    EXPECT_THROW(TimesOfTake(body, reached, wrist, wrist, arm, 30.0), Error);
  }
  const std::vector<int> fine = {40, 78};
  const TakeTimes times = TimesOfTake(body, fine, wrist, wrist, arm, 30.0);
  EXPECT_EQ(times.take - times.arrive, 9);
  EXPECT_LE(std::abs(times.arrive - 40), 12);
  EXPECT_LT(times.begin, times.pregrasp);
  EXPECT_EQ(times.goals, std::vector<int>{78});
}

}  // namespace
}  // namespace holdfast
