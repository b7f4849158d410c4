// SPDX-License-Identifier: MIT
#include "solver/synthesis/sample_style.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "generator/body/limb_ik.h"
#include "generator/matching/body_frame.h"
#include "generator/nn/random_stream.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/rotation.h"
#include "solver/synthesis/synthesis_motion.h"

namespace holdfast {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond Turned(const Vector3d& axis_angle) { return Quaterniond(ExpSO3(axis_angle)); }

void Stylise(const SampleStyle& style, const Eigen::Matrix3Xd& rest_joints, double share,
             BodyFrame& frame) {
  for (const int joint : {kSpine1, kSpine2, kSpine3}) {
    frame.local[joint] = Turned(share / 3.0 * style.trunk) * frame.local[joint];
  }
  ShiftWeight(style.weight, share, frame);
  const Limb other = Arm(Side::kLeft), arm = Arm(Side::kRight);
  // A bent elbow has the forearm before the belly: straight ahead nobody holds it for long.
  constexpr double kTurnsIn = 30.0 * kDegree;  // farther is beyond what captured shoulders do
  const Vector3d upper = (rest_joints.col(other.middle) - rest_joints.col(other.root)).normalized();
  frame.local[other.root] =
      Turned(share * style.other_arm) * frame.local[other.root] *
      Quaterniond(Eigen::AngleAxisd(share * std::min(style.other_elbow, kTurnsIn), upper));
  frame.local[other.middle] =
      frame.local[other.middle] *
      Quaterniond(Eigen::AngleAxisd(share * style.other_elbow, other.hinge));
  // The elbow swings about the line from shoulder to wrist; the hand stays as it is.
  const BodyPlacement placed = Place(rest_joints, frame);
  const Vector3d along = placed.joints.col(arm.end) - placed.joints.col(arm.root);
  if (along.norm() < 1e-6) return;
  const Matrix3d swing =
      Eigen::AngleAxisd(share * style.elbow, along.normalized()).toRotationMatrix();
  const Matrix3d& parent = placed.rotation[kJointParents[arm.root]];
  frame.local[arm.root] =
      Quaterniond(Matrix3d(parent.transpose() * swing * placed.rotation[arm.root])).normalized();
  const Matrix3d lower = swing * placed.rotation[arm.middle];
  frame.local[arm.end] =
      Quaterniond(Matrix3d(lower.transpose() * placed.rotation[arm.end])).normalized();
}

}  // namespace

void ShiftWeight(const Eigen::Vector2d& weight, double share, BodyFrame& frame) {
  constexpr double kRollPerMetre = 1.6;  // 4 degrees for 4.5 cm
  const Matrix3d heading = Eigen::AngleAxisd(Yaw(frame), Vector3d::UnitZ()).toRotationMatrix();
  frame.pelvis += share * (heading * Vector3d(weight.x(), -weight.y(), 0.0));
  const Vector3d ahead = heading * -Vector3d::UnitY();
  const Quaterniond roll(Eigen::AngleAxisd(share * kRollPerMetre * weight.x(), ahead));
  const Quaterniond before = frame.local[kPelvis];
  frame.local[kPelvis] = roll * before;
  frame.local[kSpine1] = before.conjugate() * roll.conjugate() * before * frame.local[kSpine1];
}

SampleStyle DrawSampleStyle(std::uint64_t seed, int sample, double amount) {
  SampleStyle style;
  if (sample == 0 || amount <= 0.0) return style;
  nn::RandomStream random(seed, 1'000'000 + static_cast<std::uint64_t>(sample));
  double drawn[10] = {};
  for (int k = 0; k < 10; k += 2) random.NormalPair(drawn[k], drawn[k + 1]);
  for (double& value : drawn) value = amount * std::clamp(value, -2.0, 2.0);
  style.pace = std::exp(0.27 * drawn[0]);
  style.trunk = kDegree * Vector3d(std::max(-4.0, 7.0 * drawn[1]), 11.0 * drawn[2], 5.0 * drawn[3]);
  style.elbow = 20.0 * kDegree * drawn[4];
  // Hanging: little forward, less outward.
  style.other_arm = kDegree * Vector3d(std::clamp(16.0 * drawn[5], -20.0, 14.0), 0.0,
                                       std::clamp(14.0 * drawn[6], -12.0, 10.0));
  style.other_elbow = std::min(70.0, 25.0 * std::abs(drawn[7]) * 1.4) * kDegree;
  style.weight = 0.03 * Eigen::Vector2d(drawn[8], 0.5 * drawn[9]);
  return style;
}

void ApplySampleStyle(const SampleStyle& style, const Eigen::Matrix3Xd& rest_joints, Clip& keys) {
  keys.frame_rate /= style.pace;
  std::vector<BodyFrame> frames = BodyFrames(keys, rest_joints);
  // How far the hand has gone from where it was, as the trunk has it.
  std::vector<Vector3d> hands;
  std::vector<Eigen::Isometry3d> wrists;
  for (const BodyFrame& frame : frames) {
    const BodyPlacement placed = Place(rest_joints, frame);
    wrists.push_back(placed.WorldFromJoint(kRightWrist));
    hands.push_back(placed.WorldFromJoint(kSpine3).inverse() * placed.joints.col(kRightWrist));
  }
  double farthest = 0.05;  // metres
  for (const Vector3d& hand : hands) farthest = std::max(farthest, (hand - hands.front()).norm());
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const double share = MinimumJerk((hands[t] - hands.front()).norm() / farthest);
    Stylise(style, rest_joints, share, frames[t]);
    if (!keys.object) continue;
    const auto frame = static_cast<Eigen::Index>(t);
    const Eigen::Isometry3d now = Place(rest_joints, frames[t]).WorldFromJoint(kRightWrist);
    keys.object->SetPose(frame, now * wrists[t].inverse() * keys.object->Pose(frame));
  }
  SetBodyFrames(frames, rest_joints, keys);
}

}  // namespace holdfast
