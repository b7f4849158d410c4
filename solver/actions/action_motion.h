// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/actions/action_path.h"
#include "generator/actions/action_script.h"
#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"
#include "solver/actions/action_choice.h"
#include "solver/body_ik/frame_pose.h"
#include "solver/terms/body/goal_terms.h"
#include "solver/terms/body/posture_terms.h"

namespace holdfast {

/// Solves trunk, head, right arm and pelvis of a whole clip so that the right wrist follows `path`
/// (until `path_end_s`; free afterwards) and the face turns and the chest leans as scripted: least
/// squares over all frames at once (Ceres) with HeldAtFace, Gaze, TrunkLean, LegReach, Balance,
/// JointRange and a prior, over a cubic B-spline change of `frames`, an idling person. Feet stay at
/// `feet`: the legs follow by two-bone inverse kinematics. The captured idle motion is preserved
/// underneath. Frames are unchanged if there is no usable solution.
void MoveActionBody(const Eigen::Matrix3Xd& rest_joints, const FeetTarget& feet,
                    const ActionScript& script, const ActionPath& path, double path_end_s,
                    std::vector<BodyFrame>& frames);

/// All terms on the body in one frame of an action: 26 residuals.
struct ActionFrameTerms {
  HeldAtFace hand;
  Gaze gaze;
  TrunkLean lean;
  LegReach legs;
  Balance balance;
  JointRange range;

  auto Tied() const { return std::tie(hand, gaze, lean, legs, balance, range); }
};
using ActionFrameBlock = FrameBlock<ActionFrameTerms>;

inline constexpr double kActionRate = 30.0;  ///< frames per second of synthetic actions

/// Body and object motion of a script; fingers as grasped, not fitted yet.
struct ActionMotion {
  std::vector<BodyFrame> frames;  ///< 30 fps
  std::vector<Eigen::Isometry3d> object;
  std::vector<std::uint8_t> holding;  ///< as Clip::holding_hand
  /// Per frame and hand (right, left): 0 relaxed, 1 as grasped.
  std::vector<std::array<double, 2>> closed;
  double worst_hand_error_rad = 0.0;  ///< while holding: unattainable wrist rotation
  double worst_shortfall_m = 0.0;     ///< while holding: shortfall of the arm
};

/// Builds the motion: hand paths through the chosen keys, the trunk by whole-body inverse
/// kinematics (MoveActionBody), then both arms exactly (ArmIk) with elbows that are comfortable
/// over the whole clip. `idle`: one frame per frame of the script.
ActionMotion MakeActionMotion(const ActionActor& actor, const ActionScript& script,
                              const ActionGrasp& grasp, const ActionChoice& choice,
                              const std::vector<BodyFrame>& idle);

/// Number of frames of a clip of this script, 30 fps.
int FramesOf(const ActionScript& script);

}  // namespace holdfast
