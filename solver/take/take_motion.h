// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "solver/take/take_path.h"
#include "solver/take/take_plan.h"

namespace holdfast {

/// A motion in which the object is taken and carried, the fit still to come.
struct TakeMotion {
  /// Arm and fingers made anew; the object stands until the take, is led by the hand as it has hold
  /// of it from then on; `holding_hand` states it.
  Clip clip;
  TakeCandidate take;  ///< as this body takes the object: of the plan's candidates
  TakeTimes times;
  UprightPose standing;
  std::string fault;  ///< why this motion does not serve; empty when it does

  std::vector<double> hand_error_rad;  ///< per frame: of the hand's rotation from what was wished
  std::vector<double> shortfall_m;     ///< per frame: how much the arm is too short

  double take_wrist_error_m = 0.0;  ///< of the wrist joint at the take, from where the grasp has it
  double take_hand_error_rad = 0.0;   ///< of the hand's rotation then
  double shoulder_shortfall_m = 0.0;  ///< at the take, before the trunk leans
  double coming_shortfall_m = 0.0;    ///< greatest on the line and while closing
  double coming_hand_error_rad = 0.0;
  double max_shortfall_m = 0.0;     ///< greatest while carrying
  double max_hand_error_rad = 0.0;  ///< greatest wish that the wrist's limits refused, carrying

  /// Larger is better, for choosing among motions.
  double score = 0.0;
};

/// Makes a body's motion take and carry the object. At the take the grasp (and, where it is free,
/// the object's yaw) is chosen anew among the plan's candidates for the shoulder that is there. The
/// trunk leans as far as the arm is short (WarpReach), with the feet where they are. The arm is
/// solved in every frame from 0.9 s before the wrist arrives: along the line of the approach to the
/// grasp, held there while the fingers close, then as the object's way (ObjectWay) has it; the
/// swivel is smooth over time. Fingers: ready on the way, closing, closed. The head looks at the
/// object while it is reached for. `like` is as for wandr::ClipOfStates.
TakeMotion MakeTakeMotion(const TakePlan& plan, const TakeBodyMotion& motion, const HandModel& hand,
                          const TakeObject& object, const Clip& like);

}  // namespace holdfast
