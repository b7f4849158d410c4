// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "generator/matching/body_frame.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/take/take_path.h"
#include "solver/take/take_plan.h"

namespace holdfast {

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
