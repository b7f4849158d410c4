// SPDX-License-Identifier: MIT
#include "generator/body/limb_ik.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

// Right-handed frame with its first axis along `along` and its second as close to `hinge` as
// possible.
Eigen::Matrix3d BoneFrame(const Eigen::Vector3d& along, const Eigen::Vector3d& hinge) {
  Eigen::Matrix3d frame;
  frame.col(0) = along.normalized();
  frame.col(1) = (hinge - hinge.dot(frame.col(0)) * frame.col(0)).normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

struct Bones {
  Eigen::Vector3d upper, lower;  // rest frame
  double a, b;                   // their lengths
};

Bones BonesOf(const Eigen::Matrix3Xd& rest_joints, const Limb& limb) {
  const Eigen::Vector3d upper = rest_joints.col(limb.middle) - rest_joints.col(limb.root);
  const Eigen::Vector3d lower = rest_joints.col(limb.end) - rest_joints.col(limb.middle);
  return {upper, lower, upper.norm(), lower.norm()};
}

double Reach(const Bones& bones, double flexion) {
  return std::sqrt(std::max(
      0.0, bones.a * bones.a + bones.b * bones.b + 2.0 * bones.a * bones.b * std::cos(flexion)));
}

}  // namespace

Limb Arm(Side side) {
  const double sign = side == Side::kRight ? 1.0 : -1.0;
  const int wrist = WristJoint(side);
  return {wrist - 4,     wrist - 2,      wrist, sign * Eigen::Vector3d::UnitY(),
          2.0 * kDegree, 150.0 * kDegree};
}

Limb Leg(Side side) {
  const int hip = side == Side::kRight ? 2 : 1;
  return {hip, hip + 3, hip + 6, Eigen::Vector3d::UnitX(), 1.0 * kDegree, 150.0 * kDegree};
}

double MinReach(const Eigen::Matrix3Xd& rest_joints, const Limb& limb) {
  return Reach(BonesOf(rest_joints, limb), limb.max_flexion_rad);
}

double MaxReach(const Eigen::Matrix3Xd& rest_joints, const Limb& limb) {
  return Reach(BonesOf(rest_joints, limb), limb.min_flexion_rad);
}

LimbPose SolveLimb(const Eigen::Matrix3Xd& rest_joints, const Limb& limb,
                   const Eigen::Vector3d& root, const Eigen::Vector3d& target,
                   const Eigen::Vector3d& pole) {
  const Bones bones = BonesOf(rest_joints, limb);
  const Eigen::Vector3d to_target = target - root;
  const double asked = to_target.norm();
  const double distance =
      std::clamp(asked, Reach(bones, limb.max_flexion_rad), Reach(bones, limb.min_flexion_rad));
  const Eigen::Vector3d along = asked > 1e-9 ? Eigen::Vector3d(to_target / asked)
                                             : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
  Eigen::Vector3d outward = pole - pole.dot(along) * along;
  if (outward.norm() < 1e-9 * (1.0 + pole.norm())) outward = along.unitOrthogonal();
  outward.normalize();

  // Law of cosines: angle at the root between the upper bone and the line to the target.
  const double cosine =
      (bones.a * bones.a + distance * distance - bones.b * bones.b) / (2.0 * bones.a * distance);
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
  const Eigen::Vector3d upper = bones.a * (std::cos(angle) * along + std::sin(angle) * outward);
  const Eigen::Vector3d lower = distance * along - upper;
  const Eigen::Vector3d hinge = outward.cross(along);

  LimbPose pose;
  pose.upper = BoneFrame(upper, hinge) * BoneFrame(bones.upper, limb.hinge).transpose();
  pose.lower = BoneFrame(lower, hinge) * BoneFrame(bones.lower, limb.hinge).transpose();
  pose.end = root + pose.upper * bones.upper + pose.lower * bones.lower;
  pose.flexion_rad = std::atan2(upper.cross(lower).norm(), upper.dot(lower));
  pose.reached = distance == asked;
  return pose;
}

WristPose SolveWrist(const Eigen::Matrix3Xd& rest_joints, Side side, const Eigen::Matrix3d& lower,
                     const Eigen::Matrix3d& hand, const WristLimits& limits) {
  const double sign = side == Side::kRight ? 1.0 : -1.0;
  const Limb arm = Arm(side);
  const Eigen::Vector3d forearm =
      (rest_joints.col(arm.end) - rest_joints.col(arm.middle)).normalized();
  // relative = twist about the forearm, then swing of the wrist.
  Eigen::Quaterniond relative(Eigen::Matrix3d(lower.transpose() * hand));
  if (relative.w() < 0.0) relative.coeffs() = -relative.coeffs();
  const double twist = 2.0 * std::atan2(relative.vec().dot(forearm), relative.w());
  const Eigen::Matrix3d untwist = ExpSO3(-twist * forearm);
  Eigen::Vector3d swing = LogSO3(untwist * relative.toRotationMatrix());

  WristPose pose;
  pose.twist_rad = std::clamp(twist, -limits.twist_max, limits.twist_max);
  const double flexion = sign * swing.z();
  const double ulnar = -sign * swing.y();
  pose.flexion_rad = std::clamp(flexion, limits.flexion_min, limits.flexion_max);
  pose.ulnar_rad = std::clamp(ulnar, limits.ulnar_min, limits.ulnar_max);
  swing.z() = sign * pose.flexion_rad;
  swing.y() = -sign * pose.ulnar_rad;
  const Eigen::Matrix3d half_twist = ExpSO3(0.5 * pose.twist_rad * forearm);
  pose.lower = lower * half_twist;
  pose.wrist = half_twist * ExpSO3(swing);
  pose.reached = pose.twist_rad == twist && pose.flexion_rad == flexion && pose.ulnar_rad == ulnar;
  return pose;
}

Eigen::Matrix3d HandOrientation(Side side, const Eigen::Vector3d& fingers,
                                const Eigen::Vector3d& thumb) {
  const Eigen::Vector3d x = (side == Side::kRight ? -1.0 : 1.0) *
                            fingers.normalized();  // rest fingers point along -x or +x
  Eigen::Vector3d z = thumb - thumb.dot(x) * x;
  if (!(z.norm() > 1e-6 * thumb.norm())) {
    throw Error("hand orientation", "fingers and thumb point the same way",
                "Give two different directions");
  }
  z.normalize();
  Eigen::Matrix3d hand;
  hand << x, z.cross(x), z;
  return hand;
}

}  // namespace holdfast
