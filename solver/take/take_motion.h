// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
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

/// Rotates an upright object about the vertical through its bottom center, frame by frame from
/// `take` on, to keep the holding hand within the wrist's limits and comfortable; its yaw is free.
/// Minimizes
///
///   (hand error / 3 degrees)^2 + (arm shortfall / 2 cm)^2 + 0.1 discomfort + (turn / 60 degrees)^2
///   + (change / (60 degrees per second))^2
///
/// summed over frames, by dynamic programming (up to 60 degrees, steps of 6), then Gaussian
/// smoothing of 0.15 s; zero at the take. Changes `way` (one pose per frame of `body`) in place.
void EaseTurns(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
               std::span<const BodyPlacement> body, int take_frame, double frame_rate,
               std::vector<Eigen::Isometry3d>& way);

/// Returns the plan's candidate, with the object's yaw if free, that best suits the body at the
/// take, including the wrist's distance from its current position.
TakeCandidate ChooseTake(const TakePlan& plan, const TakeObject& object, const ArmIk& arm,
                         const BodyPlacement& body);

/// Returns the most comfortable yaw of the object at `place` for a body that holds it by `take`; of
/// equal ones the first from `usual_yaw` (radians) on.
UprightPose ComfortableAt(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
                          const Eigen::Vector3d& place, const BodyPlacement& body,
                          double usual_yaw);

}  // namespace holdfast
