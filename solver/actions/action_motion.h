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

/// Body and object motion of a script; fingers as grasped, not fitted yet.
struct ActionMotion {
  std::vector<BodyFrame> frames;  ///< 30 fps
  std::vector<Eigen::Isometry3d> object;
  std::vector<std::uint8_t> holding;  ///< as Clip::holding_hand
  /// Per frame and hand (right, left): 0 relaxed, 1 as grasped.
  std::vector<std::array<double, 2>> closed;
  ActionBodyReport body;
  double worst_hand_error_rad = 0.0;  ///< while holding: unattainable wrist rotation
  double worst_shortfall_m = 0.0;     ///< while holding: shortfall of the arm
};

/// Builds the motion: hand paths through the chosen keys, the trunk by whole-body inverse
/// kinematics (MoveActionBody), then both arms exactly (ArmIk) with elbows that are comfortable
/// over the whole clip. `idle`: one frame per frame of the script.
ActionMotion MakeActionMotion(const ActionPerson& person, const BodyMeasures& body,
                              const ActionScript& script, const ActionGrasp& grasp,
                              const ActionChoice& choice, const std::vector<BodyFrame>& idle,
                              const ActionBodyOptions& options = {});

/// Number of frames of a clip of this script, 30 fps.
int FramesOf(const ActionScript& script);

}  // namespace holdfast
