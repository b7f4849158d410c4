// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include <Eigen/Core>

namespace holdfast {

/// The SMPL-X skeleton: 55 joints, in the order of every SMPL-X file (Pavlakos et al., CVPR 2019).
/// Axis-angle poses are 3 x 55, column j the rotation of joint j relative to its parent. Rest pose:
/// T-pose, y up, facing +z, +x to the body's left; meters.
enum Joint : int {
  kPelvis,
  kLeftHip,
  kRightHip,
  kSpine1,
  kLeftKnee,
  kRightKnee,
  kSpine2,
  kLeftAnkle,
  kRightAnkle,
  kSpine3,
  kLeftFoot,
  kRightFoot,
  kNeck,
  kLeftCollar,
  kRightCollar,
  kHead,
  kLeftShoulder,
  kRightShoulder,
  kLeftElbow,
  kRightElbow,
  kLeftWrist,
  kRightWrist,
  kJaw,
  kLeftEye,
  kRightEye,
};
inline constexpr int kNumJoints = 55;
inline constexpr int kNumBodyJoints = kRightWrist + 1;  ///< pelvis to right_wrist: joints 0..21
inline constexpr int kLeftHandBegin =
    25;  ///< first of 15 finger joints: index, middle, pinky, ring, thumb
inline constexpr int kRightHandBegin = 40;
inline constexpr int kJointsPerHand = 15;
inline constexpr int kHandDofs = 3 * kJointsPerHand;

extern const std::array<std::string_view, kNumJoints> kJointNames;
extern const std::array<int, kNumJoints>
    kJointParents;  ///< -1 for the pelvis; always parent < child

/// Returns the index of a joint by name; nothing if there is no such joint.
std::optional<int> FindJoint(std::string_view name);

/// Returns the same joint on the other side (itself for the spine, head and jaw).
int MirrorJoint(int joint);

enum class Side { kRight, kLeft };

inline constexpr int HandBegin(Side side) {
  return side == Side::kRight ? kRightHandBegin : kLeftHandBegin;
}
inline constexpr int WristJoint(Side side) {
  return side == Side::kRight ? kRightWrist : kLeftWrist;
}
inline constexpr bool IsFinger(int joint, Side side) {
  return joint >= HandBegin(side) && joint < HandBegin(side) + kJointsPerHand;
}
inline constexpr Side OtherSide(Side side) {
  return side == Side::kRight ? Side::kLeft : Side::kRight;
}
std::string_view SideName(Side side);  ///< "right" or "left"

/// Rotations of all joints relative to their parents, axis-angle, one column per joint, radians.
using JointPose = Eigen::Matrix<double, 3, kNumJoints>;

/// Mirrors a pose at x = 0: sides swapped, y and z of every axis-angle negated.
JointPose MirrorPose(const JointPose& pose);

/// Rest pelvis positions J_0 of the neutral models' mean shapes, meters (J_regressor v_template),
/// from public code: SMPL-X from the retargeting tables of kimodo (SMPLX_REST_WORLD); SMPL, whose
/// body SMPL-H shares, from its simulation model smpl_humanoid.xml. The male and female models' are
/// within a few centimeters.
inline const Eigen::Vector3d kSmplxRestPelvis(0.0031, -0.3514, 0.0120);
inline const Eigen::Vector3d kSmplhRestPelvis(-0.0018, -0.2233, 0.0282);

/// Of the embedded body at zero betas: equal to SMPL-X's, so that its clips are placed correctly by
/// code written for SMPL-X.
inline const Eigen::Vector3d kEmbeddedRestPelvis = kSmplxRestPelvis;

}  // namespace holdfast
