// SPDX-License-Identifier: MIT
#include "solver/synthesis/arm_ease.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "generator/matching/body_frame.h"
#include "generator/scripted/minimum_jerk.h"
#include "geometry/rotation.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/synthesis/synthesis_motion.h"

namespace holdfast {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kOffSide_rad = 20.0 * kDegree;  // that a brush may point off its direction

// 0 where the hand was in the first frame, 1 where it is farthest from there, as the chest has it.
std::vector<double> SharesOfWay(const std::vector<BodyPlacement>& placed) {
  std::vector<double> shares;
  double farthest = 0.05;  // metres
  const Isometry3d chest = placed.front().WorldFromJoint(kSpine3).inverse();
  const Vector3d first = chest * placed.front().joints.col(kRightWrist);
  for (const BodyPlacement& frame : placed) {
    const Vector3d hand = frame.WorldFromJoint(kSpine3).inverse() * frame.joints.col(kRightWrist);
    shares.push_back((hand - first).norm());
    farthest = std::max(farthest, shares.back());
  }
  for (double& share : shares) share = MinimumJerk(std::min(1.0, 1.15 * share / farthest));
  return shares;
}

// The turn about its bristles, in the world, that has a brush come from the hand's side.
Matrix3d FromTheSide(const Isometry3d& head, const Vector3d& forward_in_world, double share) {
  const Vector3d wanted = head.linear() * Vector3d(1.0, 0.1, -0.35).normalized();
  const Eigen::AngleAxisd turn(Quaterniond::FromTwoVectors(forward_in_world, wanted));
  const double angle = std::max(0.0, turn.angle() - kOffSide_rad);
  return Eigen::AngleAxisd(share * angle, turn.axis()).toRotationMatrix();
}

Quaterniond Between(const Matrix3d& parent, const Matrix3d& child) {
  return Quaterniond(Matrix3d(parent.transpose() * child)).normalized();
}

}  // namespace

void EaseArm(const ActionActor& actor, const ActionProp& prop, std::string_view action,
             double elbow_rad, Clip& clip) {
  const Eigen::Matrix3Xd& rest_joints = actor.Measures().rest_joints;
  std::vector<BodyFrame> frames = BodyFrames(clip, rest_joints);
  const std::vector<Isometry3d> hands = HoldingHands(rest_joints, frames, clip);
  const std::vector<BodyPlacement> placed = Place(rest_joints, frames);
  const std::vector<double> shares = SharesOfWay(placed);
  const ArmIk& arm = actor.Person().right;
  const Limb& limb = arm.Bones();
  std::vector<ArmTarget> targets;
  for (std::size_t t = 0; t < frames.size(); ++t) {
    Isometry3d wrist = hands[t];
    if (action == "brush") {
      const Isometry3d object = clip.object->Pose(static_cast<Eigen::Index>(t));
      const Matrix3d turn = FromTheSide(placed[t].WorldFromJoint(kHead),
                                        object.linear() * prop.marks.forward, shares[t]);
      const Vector3d bristles = object * prop.marks.tip;
      wrist.linear() = turn * wrist.linear();
      wrist.translation() = bristles + turn * (wrist.translation() - bristles);
    }
    targets.push_back({placed[t].joints.col(limb.root), placed[t].rotation[kSpine3], wrist});
  }
  const std::vector<double> swivels = arm.Track(targets, clip.frame_rate);
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const ArmChoice chosen = arm.At(targets[t], swivels[t] + elbow_rad);
    const Matrix3d& collar = placed[t].rotation[static_cast<std::size_t>(kRightCollar)];
    const auto turn = [&](int joint, const Quaterniond& to) {
      Quaterniond& local = frames[t].local[static_cast<std::size_t>(joint)];
      local = local.slerp(shares[t], to);
    };
    turn(limb.root, Between(collar, chosen.limb.upper));
    turn(limb.middle, Between(chosen.limb.upper, chosen.wrist.lower));
    turn(limb.end, Quaterniond(chosen.wrist.wrist).normalized());
  }
  TakeAlong(rest_joints, frames, hands, clip);
  SetBodyFrames(frames, rest_joints, clip);
}

}  // namespace holdfast
