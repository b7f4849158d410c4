// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/matching/body_frame.h"
#include "geometry/clip/clip.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/take/take_path.h"
#include "solver/take/take_plan.h"

namespace holdfast {

/// A motion that takes and carries the object, before the fit.
struct TakeMotion {
  /// Arm and fingers are solved; the object stands until the take and then moves rigidly with the
  /// hand; `holding_hand` is set accordingly.
  Clip clip;
  TakeCandidate take;  ///< the plan's candidate that this body uses
  TakeTimes times;
  UprightPose standing;
  std::string fault;  ///< why this motion is unsuitable; empty if suitable

  std::vector<double> hand_error_rad;  ///< per frame: of the hand's rotation from its target
  std::vector<double> shortfall_m;     ///< per frame: of the arm

  double take_wrist_error_m = 0.0;    ///< distance of the wrist joint from the grasp's, at the take
  double take_hand_error_rad = 0.0;   ///< of the hand's rotation at the take
  double shoulder_shortfall_m = 0.0;  ///< at the take, before the trunk leans
  double coming_shortfall_m = 0.0;    ///< maximum on the approach line and while closing
  double coming_hand_error_rad = 0.0;
  double max_shortfall_m = 0.0;     ///< maximum while carrying
  double max_hand_error_rad = 0.0;  ///< maximum while carrying, from the wrist's limits

  /// Larger is better; for selection among motions.
  double score = 0.0;
};

/// Makes a body motion take and carry the object. At the take the grasp (and the object's yaw, if
/// free) is selected again among the plan's candidates for the actual shoulder. The trunk leans as
/// far as the arm is short (WarpReach), with fixed feet. The arm is solved in every frame from 0.9
/// s before the wrist arrives: along the approach line to the grasp, held there while the fingers
/// close, then along the object's path (ObjectWay), with a smooth swivel. Fingers: ready on the
/// way, closing, closed. The head looks at the object while reaching. `like` is as for
/// wandr::ClipOfStates.
TakeMotion MakeTakeMotion(const TakePlan& plan, const TakeBodyMotion& motion, const HandModel& hand,
                          const TakeObject& object, const Clip& like);

}  // namespace holdfast
