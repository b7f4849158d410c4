// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/action_script.h"
#include "generator/matching/body_frame.h"
#include "generator/scripted/reach_motion.h"
#include "solver/actions/action_body.h"
#include "solver/actions/action_choice.h"

namespace holdfast {

inline constexpr double kActionRate = 30.0;  ///< frames per second of synthetic actions

/// A body that does what a script says, the object in its hand; fingers as grasped, not fitted yet.
struct ActionMotion {
  std::vector<BodyFrame> frames;  ///< 30 fps
  std::vector<Eigen::Isometry3d> object;
  std::vector<std::uint8_t> holding;  ///< as Clip::holding_hand
  /// Per frame and hand (right, left): 0 relaxed, 1 as the grasp has it.
  std::vector<std::array<double, 2>> closed;
  ActionBodyReport body;
  double worst_hand_error_rad = 0.0;  ///< while a hand holds: what its wrist refuses
  double worst_shortfall_m = 0.0;     ///< while a hand holds: by which its arm is too short
};

/// Makes the motion: the hands' paths through the chosen keys, the trunk by whole-body inverse
/// kinematics (MoveActionBody), then both arms exactly (ArmIk), elbows where they are comfortable
/// over the whole clip. `idle`: as many frames as the script is long.
ActionMotion MakeActionMotion(const ActionPerson& person, const BodyMeasures& body,
                              const ActionScript& script, const ActionGrasp& grasp,
                              const ActionChoice& choice, const std::vector<BodyFrame>& idle,
                              const ActionBodyOptions& options = {});

/// Frames of a clip of this script, 30 fps.
int FramesOf(const ActionScript& script);

}  // namespace holdfast
