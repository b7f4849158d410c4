// SPDX-License-Identifier: MIT
#include "generator/body/finger_pose.h"

#include <algorithm>
#include <array>

#include <Eigen/Geometry>

#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kThumb = 4;

/// Degrees; fingers in skeleton order. Spread is away from the middle finger. `opposition` of the
/// thumb turns its pad to face the fingers.
struct HandShape {
  std::array<std::array<double, 3>, 5> flexion;
  std::array<double, 4> spread;
  double opposition;
};

constexpr HandShape kRelaxed = {
    {{{18, 26, 14}, {22, 30, 16}, {30, 34, 18}, {26, 33, 17}, {6, 12, 12}}}, {1, 0, 2, 1}, 12};
constexpr HandShape kOpen = {
    {{{8, 12, 6}, {8, 14, 8}, {12, 16, 8}, {10, 15, 8}, {-4, 4, 4}}}, {6, 0, 8, 3}, 24};
constexpr HandShape kClosed = {
    {{{46, 52, 28}, {50, 56, 32}, {56, 54, 32}, {53, 56, 32}, {14, 24, 26}}}, {1, 0, 1, 0}, 38};

HandShape Mix(const HandShape& a, const HandShape& b, double t) {
  HandShape mix;
  for (std::size_t f = 0; f < 5; ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      mix.flexion[f][k] = (1.0 - t) * a.flexion[f][k] + t * b.flexion[f][k];
    }
  }
  for (std::size_t f = 0; f < 4; ++f) mix.spread[f] = (1.0 - t) * a.spread[f] + t * b.spread[f];
  mix.opposition = (1.0 - t) * a.opposition + t * b.opposition;
  return mix;
}

FingerPose Pose(const Eigen::Matrix3Xd& rest_joints, Side side, const HandShape& shape) {
  const int begin = HandBegin(side);
  const Eigen::Vector3d palm = -Eigen::Vector3d::UnitY();
  const Eigen::Vector3d middle = rest_joints.col(begin + 3);
  FingerPose pose;
  for (int f = 0; f < 5; ++f) {
    for (int k = 0; k < 3; ++k) {
      const int joint = begin + 3 * f + k;
      const Eigen::Vector3d bone = k < 2 ? rest_joints.col(joint + 1) - rest_joints.col(joint)
                                         : rest_joints.col(joint) - rest_joints.col(joint - 1);
      // Flexion moves a fingertip towards the palm, and the thumb's towards a point under the
      // knuckle of the middle finger.
      const Eigen::Vector3d towards =
          f < kThumb ? palm : Eigen::Vector3d(middle + 0.035 * palm - rest_joints.col(joint));
      const Eigen::Vector3d axis = bone.cross(towards).normalized();
      Eigen::Matrix3d rotation = ExpSO3(shape.flexion[f][k] * kDegree * axis);
      if (k == 0 && f < kThumb) {
        const Eigen::Vector3d from_middle = rest_joints.col(joint) - middle;
        const double outward = from_middle.z() >= 0.0 ? 1.0 : -1.0;  // rest: z points to the thumb
        const Eigen::Vector3d spread_axis = bone.cross(outward * Eigen::Vector3d::UnitZ());
        if (f != 1) {
          rotation = ExpSO3(shape.spread[f] * kDegree * spread_axis.normalized()) * rotation;
        }
      } else if (k == 0) {
        // Opposition: the whole thumb rotates under the palm about the length of the hand.
        const Eigen::Vector3d length = (middle - rest_joints.col(WristJoint(side))).normalized();
        const double sign = side == Side::kRight ? 1.0 : -1.0;
        rotation = ExpSO3(-sign * shape.opposition * kDegree * length) * rotation;
      }
      pose.segment<3>(3 * (3 * f + k)) = LogSO3(rotation);
    }
  }
  return pose;
}

}  // namespace

FingerPose RelaxedFingers(const Eigen::Matrix3Xd& rest_joints, Side side) {
  return Pose(rest_joints, side, kRelaxed);
}

FingerPose GraspingFingers(const Eigen::Matrix3Xd& rest_joints, Side side, double closure) {
  return Pose(rest_joints, side, Mix(kOpen, kClosed, std::clamp(closure, 0.0, 1.0)));
}

}  // namespace holdfast
