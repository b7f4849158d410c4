// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "geometry/body/body_model.h"
#include "geometry/body/skeleton.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// Measures of a person that the motion needs.
struct BodyMeasures {
  Eigen::Matrix3Xd rest_joints;  ///< (3 x 55) meters, rest pose
  double sole_y = 0.0;           ///< height of the soles in the rest pose, meters
};

BodyMeasures MeasureBody(const BodyModel& model, const Eigen::VectorXd& betas);

/// One key of a reach. World: z up, ground z = 0; the person stands at the origin facing -y, left
/// is +x. Channels are interpolated by minimum-jerk curves.
struct ReachKey {
  double time_s = 0.0;
  Eigen::Vector3d wrist = Eigen::Vector3d::Zero();     ///< meters
  Eigen::Matrix3d hand = Eigen::Matrix3d::Identity();  ///< world rotation of the wrist joint
  bool rest = true;              ///< the movement stops here; otherwise it passes through
  double torso_twist_rad = 0.0;  ///< positive to the left, pelvis to shoulders together
  double torso_lean_rad = 0.0;   ///< positive forward
  double weight_shift = 0.0;     ///< -1 right foot .. 1 left foot
  double knee_give_m = 0.0;      ///< lowering of the pelvis
  double grasp = 1.0;            ///< 0 open and ready, 1 closed
  double gaze = 1.0;             ///< 1 looks at the hand, 0 straight ahead
  double head_tilt_rad = 0.0;    ///< positive backward, added to the gaze
};

struct ScriptedReachOptions {
  Side side = Side::kRight;
  double frame_rate = 30.0;   ///< Hz
  double duration_s = 0.0;    ///< 0: until the last key
  double stance_width = 0.9;  ///< distance of the feet, relative to the rest pose
  double toe_out_rad = 0.12;  ///< each foot
  double liveliness = 1.0;    ///< scale of breathing and sway; 0 for none
  std::uint64_t seed = 1;     ///< phases of breathing and sway
};

/// Generates a standing person who moves one hand through the keys. Feet stay planted (leg IK); the
/// pelvis is as high as the legs allow; trunk and collarbone help; the elbow hangs; eyes and head
/// lead the hand; the other arm hangs and lags behind the trunk; fingers open and close with
/// `grasp`. Deterministic: the same input and seed give the same clip on machines with the same
/// libm. Throws Error if there are no keys or times do not increase.
Clip MakeReachMotion(const BodyMeasures& body, const std::vector<ReachKey>& keys,
                     const ScriptedReachOptions& options = {});

}  // namespace holdfast
