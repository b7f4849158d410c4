// SPDX-License-Identifier: MIT
#include "geometry/retarget/retarget.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <numbers>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "geometry/body/body_model.h"
#include "geometry/error.h"
#include "geometry/import/import_motion.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/gltf/asset/gltf_container.h"
#include "geometry/retarget/ground_contact.h"
#include "geometry/retarget/retarget_calibration.h"
#include "geometry/rotation.h"
#include "tests/support/data_folder.h"
#include "tests/support/temporary_folder.h"

namespace holdfast {
namespace {

RetargetBody DefaultBody() { return RetargetBodyOf(*BodyModel::Default()); }

SkeletonMap IdentityMap() {
  SkeletonMap map;
  map.name = "test";
  for (int j = 0; j < kNumJoints; ++j) map.source[j] = j;
  return map;
}

Eigen::Matrix3d RandomRotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
  return q.normalized().toRotationMatrix();
}

/// A clip as a capture would hold it: y up, meters times `size`, with the local axes
/// of joint j turned by `frames[j]`.
SourceMotion AsSource(const Clip& clip, const Eigen::Matrix3Xd& rest, double size,
                      const std::vector<Eigen::Matrix3d>& frames) {
  Eigen::Matrix3d y_up;
  y_up << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  SourceMotion motion;
  motion.frame_rate = clip.frame_rate;
  motion.rest_offsets = Eigen::Matrix3Xd::Zero(3, kNumJoints);
  for (int j = 0; j < kNumJoints; ++j) {
    motion.joint_names.emplace_back(kJointNames[j]);
    motion.parents.push_back(kJointParents[j]);
    if (j > 0) {
      const int p = kJointParents[j];
      motion.rest_offsets.col(j) = size * frames[p].transpose() * (rest.col(j) - rest.col(p));
    }
  }
  BodyState state;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ForwardJoints(rest, clip.pose[t], clip.trans.col(t), state);
    motion.positions.push_back(size * y_up * state.joints);
    for (int j = 0; j < kNumJoints; ++j) {
      motion.rotations.emplace_back(Eigen::Matrix3d(y_up * state.world_rotation[j] * frames[j]));
    }
  }
  // Ends for fingers, toes and head, along the bone that leads there.
  for (int j = 1; j < kNumJoints; ++j) {
    if (std::find(kJointParents.begin(), kJointParents.end(), j) != kJointParents.end()) continue;
    const int p = kJointParents[j];
    motion.end_sites.push_back(
        {j, 0.5 * size * frames[j].transpose() * (rest.col(j) - rest.col(p))});
  }
  return motion;
}

std::vector<Eigen::Matrix3d> PlainFrames() {
  return std::vector<Eigen::Matrix3d>(kNumJoints, Eigen::Matrix3d::Identity());
}

/// What bodies do: hinges bend one way, forearms roll half at the elbow and half at the wrist, the
/// spine bends evenly; in the first third both feet stand.
Clip NaturalClip(const RetargetBody& body, int frames) {
  Clip clip;
  clip.frame_rate = 30;
  clip.trans.resize(3, frames);
  const double height = body.rest_joints(1, 0) - body.floor_y;
  for (int t = 0; t < frames; ++t) {
    const double s = 2 * std::numbers::pi * t / frames;
    const double moving = t < frames / 3 ? 0 : 1;
    JointPose pose = JointPose::Zero();
    pose.col(0) = Eigen::Vector3d(std::numbers::pi / 2, 0, 0);
    const Eigen::Vector3d bend(0.1 * std::sin(s), 0.1 * std::cos(2 * s), 0.05 * std::sin(3 * s));
    for (const int j : {3, 6, 9}) pose.col(j) = bend;
    pose.col(12) = Eigen::Vector3d(0.1 * std::sin(2 * s), 0.2 * std::sin(s), 0);
    pose.col(15) = Eigen::Vector3d(0.1, 0.3 * std::cos(s), 0);
    for (const int side : {0, 1}) {
      const double sign = side == 0 ? 1 : -1;
      const double phase = s + 1.3 * side;
      pose.col(1 + side) = moving * Eigen::Vector3d(-0.6 - 0.4 * std::sin(phase), 0.1 * sign, 0.05);
      pose.col(4 + side) = moving * (0.9 + 0.6 * std::sin(phase)) * HingeAxis(4 + side);
      pose.col(7 + side) = moving * Eigen::Vector3d(0.2 * std::sin(phase), 0.05, 0);
      pose.col(16 + side) =
          Eigen::Vector3d(0.3 * std::sin(phase), -0.5 * sign, sign * (-0.9 + 0.5 * std::cos(s)));
      const Eigen::Matrix3d elbow = ExpSO3((0.9 + 0.7 * std::sin(phase)) * HingeAxis(18 + side));
      const Eigen::Vector3d forearm =
          (body.rest_joints.col(20 + side) - body.rest_joints.col(18 + side)).normalized();
      const Eigen::Matrix3d half = ExpSO3(0.5 * 0.6 * std::sin(phase + 1) * forearm);
      pose.col(18 + side) = LogSO3(elbow * half);
      // A bend about an axis across the forearm leaves the roll, half and half, as it is.
      const Eigen::Vector3d across = forearm.cross(Eigen::Vector3d::UnitX()).norm() > 0.1
                                         ? forearm.cross(Eigen::Vector3d::UnitX())
                                         : forearm.cross(Eigen::Vector3d::UnitY());
      const Eigen::Matrix3d roll = half * half;
      const Eigen::Matrix3d hand = ExpSO3(0.4 * std::cos(phase) * across.normalized()) * roll;
      pose.col(20 + side) = LogSO3(half.transpose() * hand);
      for (int f = 0; f < 5; ++f) {
        for (int k = 0; k < 3; ++k) {
          pose.col((side == 0 ? kLeftHandBegin : kRightHandBegin) + 3 * f + k) =
              (f == 4 ? 0.1 : 0.3) * (1 + std::sin(s)) * Eigen::Vector3d(0, 0, -sign);
        }
      }
    }
    clip.pose.push_back(pose);
    clip.trans.col(t) = Eigen::Vector3d(0.3 * moving * std::sin(s), 0, height) -
                        body.rest_joints.col(0) + moving * Eigen::Vector3d(0, 0, 0.2);
  }
  return clip;
}

struct Difference {
  double joint = 0;     // meters, all joints
  double rotation = 0;  // radians, all joints
};

Difference Compare(const Clip& a, const Clip& b, const Eigen::Matrix3Xd& rest, int joints) {
  Difference worst;
  BodyState x, y;
  for (int t = 0; t < a.NumFrames(); ++t) {
    ForwardJoints(rest, a.pose[t], a.trans.col(t), x);
    ForwardJoints(rest, b.pose[t], b.trans.col(t), y);
    worst.joint =
        std::max(worst.joint, (x.joints - y.joints).leftCols(joints).colwise().norm().maxCoeff());
    for (int j = 0; j < joints; ++j) {
      worst.rotation =
          std::max(worst.rotation, AngleBetween(x.world_rotation[j], y.world_rotation[j]));
    }
  }
  return worst;
}

RetargetOptions WhereItIs() {
  RetargetOptions options;
  options.find_ground = false;
  return options;
}

TEST(Retarget, CopiesASkeletonOfAnySizeThatRestsLikeSmplx) {
  const RetargetBody body = DefaultBody();
  std::srand(5);
  Clip clip = NaturalClip(body, 30);
  for (auto& pose : clip.pose) {
    pose.rightCols(kNumJoints - 1) += 0.3 * JointPose::Random().rightCols(kNumJoints - 1);
  }
  for (const double size : {0.5, 1.0, 100.0}) {
    RetargetReport report;
    const Clip found = Retarget(AsSource(clip, body.rest_joints, size, PlainFrames()),
                                IdentityMap(), body, WhereItIs(), &report);
    EXPECT_TRUE(report.same_skeleton);
    EXPECT_NEAR(report.scale * size, 1, 1e-9);
    const Difference difference = Compare(clip, found, body.rest_joints, kNumJoints);
    EXPECT_LT(difference.joint, 1e-6);
    EXPECT_LT(difference.rotation, 1e-6);
  }
}

TEST(Retarget, LocalFramesAndRestPoseOfTheSourceDoNotMatter) {
  const RetargetBody body = DefaultBody();
  const Clip clip = NaturalClip(body, 90);
  std::mt19937 random(7);
  for (int trial = 0; trial < 5; ++trial) {
    std::vector<Eigen::Matrix3d> frames;
    for (int j = 0; j < kNumJoints; ++j) frames.push_back(RandomRotation(random));
    for (const int j : {6, 9, 12, 15}) frames[j] = frames[3];  // a spine straight at rest
    RetargetReport report;
    const Clip found = Retarget(AsSource(clip, body.rest_joints, 1, frames), IdentityMap(), body,
                                WhereItIs(), &report);
    EXPECT_FALSE(report.same_skeleton);
    const Difference difference = Compare(clip, found, body.rest_joints, kNumBodyJoints);
    EXPECT_LT(difference.joint, 0.006) << trial;
    EXPECT_LT(difference.rotation, 5 * kDegree) << trial;
  }
}

// Local axes with axis `along` on the bone and the next but one towards `second`, as exporters of
// captures write them.
std::vector<Eigen::Matrix3d> BoneAligned(const Eigen::Matrix3Xd& rest, int along,
                                         const Eigen::Vector3d& second, double sign = 1) {
  std::vector<Eigen::Matrix3d> frames;
  for (int j = 0; j < kNumJoints; ++j) {
    int child = -1;
    for (int c = kNumJoints - 1; c > j; --c) {
      if (kJointParents[c] == j && c != 22) child = c;  // a head has no bone of its own
    }
    if (j == 0) child = 3;
    if (j == 9) child = 12;
    if (j == 20 || j == 21) child = j == 20 ? 28 : 43;
    if (j == 15) child = -1;
    const Eigen::Vector3d bone =
        child < 0 ? rest.col(j) - rest.col(kJointParents[j]) : rest.col(child) - rest.col(j);
    const Eigen::Vector3d x = sign * bone.normalized();
    Eigen::Vector3d z = second - second.dot(x) * x;
    if (z.norm() < 0.05) z = Eigen::Vector3d::UnitY() - x.y() * x;
    z.normalize();
    Eigen::Matrix3d frame;
    frame.col(along % 3) = x;
    frame.col((along + 1) % 3) = z.cross(x);
    frame.col((along + 2) % 3) = z;
    frames.push_back(frame);
  }
  return frames;
}

// Axes of the world in a rest pose that is `pose`.
std::vector<Eigen::Matrix3d> RestingIn(const Eigen::Matrix3Xd& rest, const JointPose& pose) {
  BodyState state;
  ForwardJoints(rest, pose, Eigen::Vector3d::Zero(), state);
  std::vector<Eigen::Matrix3d> frames;
  for (const Eigen::Matrix3d& R : state.world_rotation) frames.push_back(R.transpose());
  return frames;
}

// Without face and fingers, with end sites of no length in their place.
SourceMotion WithoutFingers(SourceMotion motion) {
  std::vector<Eigen::Quaterniond> rotations;
  for (int t = 0; t < motion.NumFrames(); ++t) {
    for (int j = 0; j < kNumBodyJoints; ++j) rotations.push_back(motion.Rotation(t, j));
    motion.positions[t] = motion.positions[t].leftCols(kNumBodyJoints).eval();
  }
  motion.rotations = rotations;
  motion.joint_names.resize(kNumBodyJoints);
  motion.parents.resize(kNumBodyJoints);
  motion.rest_offsets = motion.rest_offsets.leftCols(kNumBodyJoints).eval();
  motion.end_sites.clear();
  for (const int j : {10, 11, 15, 20, 21}) {
    motion.end_sites.push_back({j, Eigen::Vector3d::Zero()});
  }
  return motion;
}

// Angle between two clips' hands from wrist to middle finger, mean over frames, the worse hand's.
double HandAngle(const Clip& a, const Clip& b, const Eigen::Matrix3Xd& rest) {
  double worst = 0;
  BodyState x, y;
  for (const auto& [wrist, middle] : {std::pair{20, 28}, {21, 43}}) {
    double sum = 0;
    for (int t = 0; t < a.NumFrames(); ++t) {
      ForwardJoints(rest, a.pose[t], a.trans.col(t), x);
      ForwardJoints(rest, b.pose[t], b.trans.col(t), y);
      const Eigen::Vector3d p = x.joints.col(middle) - x.joints.col(wrist);
      const Eigen::Vector3d q = y.joints.col(middle) - y.joints.col(wrist);
      sum += std::atan2(p.cross(q).norm(), p.dot(q));
    }
    worst = std::max(worst, sum / a.NumFrames());
  }
  return worst;
}

TEST(Retarget, AnyRestPoseOfTheSameBonesGivesTheSamePlaces) {
  const RetargetBody body = DefaultBody();
  const Eigen::Matrix3Xd& rest = body.rest_joints;
  const auto posed = [&](const std::map<int, Eigen::Vector3d>& degrees) {
    JointPose pose = JointPose::Zero();
    for (const auto& [joint, w] : degrees) pose.col(joint) = kDegree * w;
    return RestingIn(rest, pose);
  };
  const std::map<int, Eigen::Vector3d> seated = {
      {1, {-90, 0, 0}},  {2, {-90, 0, 0}}, {4, {90, 0, 0}},   {5, {90, 0, 0}},
      {16, {0, 0, -75}}, {17, {0, 0, 75}}, {18, {0, -90, 0}}, {19, {0, 90, 0}}};
  std::map<int, Eigen::Vector3d> curled = seated;
  curled.insert({{0, {60, 30, 0}},
                 {3, {20, 0, 0}},
                 {6, {20, 0, 0}},
                 {9, {20, 0, 0}},
                 {13, {0, 0, -10}},
                 {14, {0, 0, 10}}});
  const std::pair<const char*, std::vector<Eigen::Matrix3d>> sources[] = {
      {"bones along x", BoneAligned(rest, 0, Eigen::Vector3d::UnitZ())},
      {"bones along -x", BoneAligned(rest, 0, -Eigen::Vector3d::UnitZ(), -1)},
      {"bones along y", BoneAligned(rest, 1, Eigen::Vector3d::UnitX())},
      {"bones along z", BoneAligned(rest, 2, Eigen::Vector3d::UnitY())},
      {"arms lowered", posed({{16, {0, 0, -50}}, {17, {0, 0, 50}}})},
      {"arms down", posed({{16, {0, 0, -85}}, {17, {0, 0, 85}}})},
      {"seated", posed(seated)},
      {"curled up", posed(curled)},
      {"lying", posed({{0, {-90, 0, 0}}})},
  };
  const RetargetOptions options = WhereItIs();
  const Clip moving = NaturalClip(body, 60);
  for (const Clip& clip : {moving, Slice(moving, 0, 15)}) {  // at first the legs are straight
    for (const bool fingers : {true, false}) {
      SkeletonMap map = IdentityMap();
      for (int j = kNumBodyJoints; j < (fingers ? kLeftHandBegin : kNumJoints); ++j) {
        map.source[j] = -1;
      }
      const auto source = [&](const std::vector<Eigen::Matrix3d>& frames, double size) {
        const SourceMotion whole = AsSource(clip, rest, size, frames);
        return fingers ? whole : WithoutFingers(whole);
      };
      RetargetReport report;
      const Clip expected = Retarget(source(PlainFrames(), 1), map, body, options, &report);
      ASSERT_TRUE(report.same_skeleton);
      double size = 1e-4;  // in meters of a file whose unit was mistaken, and more
      for (const auto& [name, frames] : sources) {
        const std::string what = std::string(name) + (fingers ? ", fingers" : "");
        size = size > 100 ? 1e-4 : 10 * size;
        const Clip found = Retarget(source(frames, size), map, body, options, &report);
        EXPECT_LT(Compare(expected, found, rest, kNumBodyJoints).joint, 0.005) << what;
        if (fingers) {
          BodyState x, y;
          ForwardJoints(rest, expected.pose[7], expected.trans.col(7), x);
          ForwardJoints(rest, found.pose[7], found.trans.col(7), y);
          EXPECT_LT((x.joints - y.joints).rightCols(30).colwise().norm().maxCoeff(), 0.005) << what;
        }
        EXPECT_LT(HandAngle(expected, found, rest), 5 * kDegree) << what;
        EXPECT_LT(report.worst_place_mm, 5) << what;
        EXPECT_LT(report.trunk_error_rad, 1 * kDegree) << what;
        EXPECT_LT(report.hand_error_rad[0], 5 * kDegree) << what;
        EXPECT_LT(report.hand_error_rad[1], 5 * kDegree) << what;
      }
    }
  }
}

// Axes of a hand that have nothing to do with its forearm's, and nothing on it: it is straight on
// average, and the report tells that this is not what its joint does.
TEST(Retarget, HandsWithoutAnyHintAreStraightAndReported) {
  const RetargetBody body = DefaultBody();
  const Clip clip = NaturalClip(body, 60);
  std::vector<Eigen::Matrix3d> frames = BoneAligned(body.rest_joints, 0, Eigen::Vector3d::UnitZ());
  for (const int wrist : {20, 21}) frames[wrist] = frames[wrist] * ExpSO3({0, 0, M_PI / 2});
  SkeletonMap map = IdentityMap();
  for (int j = kNumBodyJoints; j < kNumJoints; ++j) map.source[j] = -1;
  RetargetReport report;
  const Clip found =
      Retarget(WithoutFingers(AsSource(clip, body.rest_joints, 1, frames)), map, body, {}, &report);
  EXPECT_LT(HandAngle(clip, found, body.rest_joints), 30 * kDegree);
  EXPECT_GT(report.hand_error_rad[0], 60 * kDegree);
  EXPECT_GT(report.hand_error_rad[1], 60 * kDegree);
}

TEST(Retarget, FeetComeToStandOnTheGround) {
  const RetargetBody body = DefaultBody();
  const Clip clip = NaturalClip(body, 90);
  SourceMotion motion = AsSource(clip, body.rest_joints, 1, PlainFrames());
  for (auto& positions : motion.positions) positions.row(1).array() += 0.37;
  RetargetReport report;
  const Clip found = Retarget(motion, IdentityMap(), body, {}, &report);
  EXPECT_NEAR(report.ground_offset_m, -0.37, 0.002);
  EXPECT_LT(Compare(clip, found, body.rest_joints, kNumJoints).joint, 0.003);
}

TEST(Retarget, MissingPartsAreFilledIn) {
  const RetargetBody body = DefaultBody();
  const Clip clip = NaturalClip(body, 30);
  SkeletonMap map = IdentityMap();
  for (int j = 0; j < kNumJoints; ++j) {
    const bool limb = j <= 2 || j == 4 || j == 5 || j == 7 || j == 8 || (j >= 16 && j <= 21);
    if (!limb) map.source[j] = -1;
  }
  RetargetReport report;
  const Clip found =
      Retarget(AsSource(clip, body.rest_joints, 1, PlainFrames()), map, body, {}, &report);
  EXPECT_LT(report.max_wrist_error_mm, 1);
  for (int t = 0; t < found.NumFrames(); ++t) {
    EXPECT_TRUE(found.pose[t].allFinite());
    EXPECT_TRUE(found.pose[t].col(kLeftHandBegin).isApprox(body.left_hand.head<3>(), 1e-9));
  }
}

TEST(Retarget, AHandThatFlipsForAMomentIsBridged) {
  const RetargetBody body = DefaultBody();
  const Clip clip = NaturalClip(body, 60);
  std::mt19937 random(3);
  std::vector<Eigen::Matrix3d> frames = PlainFrames();
  for (const int j : {4, 5, 16, 17}) frames[j] = RandomRotation(random);  // no mere copy
  SourceMotion motion = AsSource(clip, body.rest_joints, 1, frames);
  const auto flip = [&](int t) {
    const Eigen::Matrix3d half = ExpSO3(Eigen::Vector3d(0, 0, std::numbers::pi));
    for (int j = kRightHandBegin; j < kNumJoints; ++j) {
      auto& q = motion.rotations[static_cast<std::size_t>(t) * kNumJoints + j];
      q = Eigen::Quaterniond(Eigen::Matrix3d(q.toRotationMatrix() * half));
    }
    auto& wrist = motion.rotations[static_cast<std::size_t>(t) * kNumJoints + 21];
    wrist = Eigen::Quaterniond(Eigen::Matrix3d(wrist.toRotationMatrix() * half));
  };
  flip(30);
  flip(31);
  RetargetReport report;
  const Clip found = Retarget(motion, IdentityMap(), body, {}, &report);
  EXPECT_EQ(report.repaired_hand_frames, 2);
  for (int t = 1; t < found.NumFrames(); ++t) {
    EXPECT_LT(AngleBetween(ExpSO3(found.pose[t].col(21)), ExpSO3(found.pose[t - 1].col(21))), 0.4);
  }
}

TEST(Retarget, LegsWithoutLengthAreAnError) {
  const RetargetBody body = DefaultBody();
  SourceMotion motion = AsSource(NaturalClip(body, 3), body.rest_joints, 0, PlainFrames());
  EXPECT_THROW(Retarget(motion, IdentityMap(), body), Error);
  motion.frame_rate = 0;
  EXPECT_THROW(Retarget(motion, IdentityMap(), body), Error);
}

TEST(BendHingeTest, PointsTheBoneAndStaysSteadyWhenFolded) {
  std::mt19937 random(11);
  for (const int joint : {4, 5, 18, 19}) {
    const Eigen::Vector3d rest =
        joint < 16 ? Eigen::Vector3d(0.02, -1, 0.01).normalized()
                   : Eigen::Vector3d(joint == 18 ? 1 : -1, 0.02, 0.01).normalized();
    const Eigen::Matrix3d above = RandomRotation(random);
    Eigen::Matrix3d last = above;
    for (double bend = 0; bend < 200 * kDegree; bend += 2 * kDegree) {
      const Eigen::Vector3d wobble(0.01 * std::sin(40 * bend), 0.01 * std::cos(33 * bend), 0);
      const Eigen::Vector3d to =
          above * (ExpSO3(bend * HingeAxis(joint)) * rest + wobble).normalized();
      const Eigen::Matrix3d R = BendHinge(joint, above, rest, to);
      EXPECT_LT((R * rest - to).norm(), 1e-9);
      if (bend > 0) {
        EXPECT_LT(AngleBetween(R, last), 4 * kDegree) << bend / kDegree;
      }
      last = R;
    }
  }
}

TEST(FindGroundTest, TakesTheLowestLevelWhereManyStandAndItsTilt) {
  const Eigen::Index points = 12;
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 0.002);
  std::vector<Eigen::Matrix3Xd> frames;
  for (int t = 0; t < 300; ++t) {
    Eigen::Matrix3Xd p = Eigen::Matrix3Xd::Constant(3, points, 1.0);
    const double x = 4.0 * (t / 50) / 6, y = 0.2 * ((t / 50) % 2);
    const double step = (t / 50) == 3 ? 0.15 : 0;  // once upon a block
    for (int i = 0; i < GroundProbe::kNumSoles; ++i) {
      p.col(i) = Eigen::Vector3d(x, y, 0.07 + 0.015 * x + step + noise(random));
    }
    if (t == 77) p(2, 0) = -1;  // an outlier below everything
    frames.push_back(p);
  }
  const GroundPlane level = FindGround(frames, 30, false);
  EXPECT_NEAR(level.height, 0.09, 0.03);
  EXPECT_TRUE(level.slope.isZero());
  const GroundPlane plane = FindGround(frames, 30, true);
  EXPECT_NEAR(plane.slope.x(), 0.015, 0.002);
  EXPECT_NEAR(plane.height, 0.07, 0.004);
}

// --- Files of our own of one motion, as other programs write it ---------------------------------

class SameMotion : public ::testing::Test {
 protected:
  static std::filesystem::path Case(const std::string& name) {
    return std::filesystem::path(HOLDFAST_SOURCE_DIR) / "tests/fixtures/cases" / name;
  }
  Clip Import(const std::string& name, ImportOptions options = {}) {
    return ImportMotion(Case(name), body_, options, &report_);
  }
  // Largest distance of the joints of the body.
  double Off(const Clip& clip) const {
    return Compare(expected_, clip, body_.rest_joints, kNumBodyJoints).joint;
  }

  const RetargetBody body_ = DefaultBody();
  ImportReport report_;
  const Clip expected_ = ImportMotion(Case("bvh_rest_not_T/t_pose.bvh"), body_);
};

TEST_F(SameMotion, BonesAlongTheirOwnAxes) {
  EXPECT_LT(Off(Import("bvh_rest_not_T/bone_aligned.bvh")), 0.001);
  EXPECT_THAT(report_.notes, ::testing::IsEmpty());
}

TEST_F(SameMotion, HandsThatAreNotInTheFileLieAlongTheForearm) {
  const Clip clip = Import("bvh_lafan_hands/lafan_like.bvh");
  EXPECT_LT(Off(clip), 0.001);
  EXPECT_LT(HandAngle(expected_, clip, body_.rest_joints), 5 * kDegree);
  EXPECT_EQ(report_.retarget.repaired_hand_frames, 0);
  EXPECT_THAT(report_.notes, ::testing::IsEmpty());
}

TEST_F(SameMotion, ZUpIsSeenAndNoted) {
  EXPECT_LT(Off(Import("bvh_z_up/zup.bvh")), 0.001);
  EXPECT_EQ(report_.up, UpAxis::kZ);
  ASSERT_EQ(report_.notes.size(), 1u);
  EXPECT_THAT(report_.notes[0], ::testing::HasSubstr("z is up"));
  ImportOptions options;
  options.up = UpAxis::kY;
  const Clip lying = Import("bvh_z_up/zup.bvh", options);
  EXPECT_GT(Off(lying), 0.3);
  EXPECT_THAT(report_.notes, ::testing::IsEmpty());
}

TEST_F(SameMotion, AnyAxisMayBeUp) {
  const SourceMotion z_up = ReadMotion(Case("bvh_z_up/zup.bvh"));
  for (const UpAxis up : {UpAxis::kX, UpAxis::kMinusX, UpAxis::kMinusY, UpAxis::kMinusZ}) {
    const Eigen::Matrix3d turn = UprightFrom(up).transpose() * UprightFrom(UpAxis::kZ);
    SourceMotion motion = z_up;
    for (auto& positions : motion.positions) positions = (turn * positions).eval();
    for (auto& q : motion.rotations) q = Eigen::Quaterniond(turn) * q;
    const Clip clip = ImportMotion(motion, "turned", body_, {}, &report_);
    EXPECT_EQ(report_.up, up) << UpAxisName(up);
    EXPECT_LT(Off(clip), 0.001) << UpAxisName(up);
  }
}

TEST_F(SameMotion, NamesOfOtherPrograms) {
  EXPECT_LT(Off(Import("bvh_names/soma.bvh")), 0.001);
  EXPECT_EQ(report_.skeleton, "SOMA");
  // Of a spine with a joint less the bend is shared.
  EXPECT_LT(Off(Import("bvh_names/daz.bvh")), 0.015);
  EXPECT_EQ(report_.skeleton, "DAZ, Poser");
}

TEST_F(SameMotion, FilesOfOtherHands) {
  for (const char* file : {"bvh_oddities/comma.bvh", "bvh_oddities/frames_too_many.bvh"}) {
    EXPECT_LT(Off(Import(file)), 0.001) << file;
    EXPECT_EQ(report_.notes.size(), 1u) << file;
  }
}

TEST_F(SameMotion, VrmTellsWhichBoneIsWhich) {
  EXPECT_LT(Off(Import("vrm_humanoid/vrm0.glb")), 0.001);
  EXPECT_EQ(report_.skeleton, "VRM humanoid");
}

// The bones of version 1.0 are an object, in another extension.
TEST_F(SameMotion, VrmOfVersion1) {
  const testing::TemporaryFolder folder;
  const std::string bytes = ReadFile(Case("vrm_humanoid/vrm0.glb"));
  const GltfContainer parts = SplitGltf(bytes, "vrm0.glb");
  nlohmann::json scene = nlohmann::json::parse(parts.json);
  nlohmann::json bones;
  for (const auto& bone : scene["extensions"]["VRM"]["humanoid"]["humanBones"]) {
    bones[bone["bone"].get<std::string>()] = {{"node", bone["node"]}};
  }
  const auto write = [&] {
    scene["extensions"] = {{"VRMC_vrm", {{"humanoid", {{"humanBones", bones}}}}}};
    scene["buffers"][0]["uri"] = "vrm1.bin";
    WriteAtomically(folder / "vrm1.bin", std::string(parts.binary));
    WriteAtomically(folder / "vrm1.gltf", scene.dump());
    return folder / "vrm1.gltf";
  };
  EXPECT_LT(Off(ImportMotion(write(), body_, {}, &report_)), 0.001);
  EXPECT_EQ(report_.skeleton, "VRM humanoid");
  bones.erase("leftHand");  // not all limbs: the names count, which are of no kind
  EXPECT_THROW(ImportMotion(write(), body_), Error);
  bones["leftHand"]["node"] = 100000;
  EXPECT_THROW(ImportMotion(write(), body_), Error);
}

// --- Real captures, where they are at hand -------------------------------------------------------

struct Capture {
  const char* file;
  const char* skeleton;
  bool stands;  // soles on the ground in most frames
};

class RealCapture : public ::testing::TestWithParam<Capture> {};

TEST_P(RealCapture, ComesOntoTheBodyWhole) {
  const auto path = testing::DataFolder() / "mocap" / GetParam().file;
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << path << " is not there; set HOLDFAST_DATA to the folder that holds mocap/";
  }
  const RetargetBody body = DefaultBody();
  ImportOptions options;
  options.frame_rate = 0;
  ImportReport report;
  const Clip clip = ImportMotion(path, body, options, &report);
  EXPECT_EQ(report.skeleton, GetParam().skeleton);
  EXPECT_TRUE(report.missing_body_joints.empty());
  EXPECT_LT(report.retarget.mean_joint_error_mm, 30);
  EXPECT_LT(report.retarget.max_wrist_error_mm, 1);
  EXPECT_LT(report.retarget.max_ankle_error_mm, 25);
  EXPECT_NEAR(report.retarget.mean_sole_height_m, 0, GetParam().stands ? 0.012 : 0.02);
  if (GetParam().stands) {
    EXPECT_GT(report.retarget.min_sole_height_m, -0.06);
  }

  BodyState state;
  double nodding = 0;
  int bent_back = 0;
  for (int t = 0; t < clip.NumFrames(); ++t) {
    ASSERT_TRUE(clip.pose[t].allFinite());
    ForwardJoints(body.rest_joints, clip.pose[t], clip.trans.col(t), state);
    for (int side : {0, 1}) {
      // Knees and elbows bend one way, up to what a straight limb's noise may do.
      const double knee = clip.pose[t].col(4 + side).dot(HingeAxis(4 + side));
      const double elbow = clip.pose[t].col(18 + side).dot(HingeAxis(18 + side));
      bent_back += (knee < -15 * kDegree) + (elbow < -20 * kDegree);
      // Feet point where the shin's front is, within what an ankle can turn.
      const Eigen::Vector3d ahead = state.world_rotation[4 + side].col(2);
      nodding += state.world_rotation[7 + side].col(2).dot(ahead) < 0.2;
    }
    if (t == 0) continue;
    for (int j = 0; j < kNumJoints; ++j) {
      EXPECT_LT((clip.pose[t].col(j) - clip.pose[t - 1].col(j)).norm() * clip.frame_rate, 60)
          << kJointNames[j] << " jumps at frame " << t;
    }
  }
  EXPECT_LT(bent_back, 0.01 * clip.NumFrames());
  EXPECT_LT(nodding, 0.02 * clip.NumFrames());
}

INSTANTIATE_TEST_SUITE_P(
    Sources, RealCapture,
    ::testing::Values(
        Capture{"sb_reach/ChrGarza_IdleStand01_ReachForwardFloor01.bvh.gz", "SmartBody", true},
        Capture{"sb_reach/ChrHarmony_Relax001_ArmReachRtHigh.bvh.gz", "SmartBody, anatomical names",
                true},
        Capture{"sb_catching/Center.bvh.gz", "SmartBody, biped names", true},
        Capture{"sb_locomotion/ChrHarmony_Walk01.bvh.gz", "SmartBody", true},
        Capture{"sb_gesture/ChrConnor_IdleStand01_BeatFlipBt01.bvh.gz", "SmartBody", true},
        Capture{"sb_punch/ChrGarza_IdleFight01_PunchForwardFloor01.bvh.gz", "SmartBody", true},
        Capture{"cmu_expmap/test_washwindow_1.bvh.gz", "CMU, BVH", true},
        Capture{"cmu_bvh/07_12.bvh.gz", "CMU, BVH", true},
        Capture{"cmu_asfamc/07_03.amc.gz", "CMU, ASF/AMC", true},
        Capture{"accad_bvh/Female1_A01_Stand.bvh.gz", "ACCAD", true},
        Capture{"accad_bvh/Male1_B13_WalkTurnRight45.bvh.gz", "ACCAD", true},
        Capture{"accad_bvh/Male1_A10_LieToCrouch.bvh.gz", "ACCAD", false}),
    [](const auto& capture) {
      std::string name(capture.param.file);
      name = name.substr(0, name.find('.'));
      for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
      return name;
    });

}  // namespace
}  // namespace holdfast
