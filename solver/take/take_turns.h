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

/// Turns an upright object about the vertical through its bottom's middle, frame by frame from
/// `take` on, so that the hand that holds it stays within the wrist's limits and comfortable: the
/// yaw of a mug's handle on its way is unconstrained. Least of
///
///   (hand error / 3 degrees)^2 + (arm shortfall / 2 cm)^2 + 0.1 discomfort + (turn / 60 degrees)^2
///   + (change / (60 degrees per second))^2
///
/// summed over frames, by dynamic programming over turns of up to 60 degrees in steps of 6, then a
/// bell of 0.15 s; none at the take. `way` (one pose per frame of `body`) is changed in place.
void EaseTurns(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
               std::span<const BodyPlacement> body, int take_frame, double frame_rate,
               std::vector<Eigen::Isometry3d>& way);

/// The plan's candidate, and the object's yaw where it is free, that suit the body as it stands at
/// the take; the wrist's way from where it is counts too.
TakeCandidate ChooseTake(const TakePlan& plan, const TakeObject& object, const ArmIk& arm,
                         const BodyPlacement& body);

/// The turn of the object about the vertical at `place` that is most comfortable for a body that
/// holds it by `take`; of equals the first from `usual_yaw` (radians) on.
UprightPose ComfortableAt(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
                          const Eigen::Vector3d& place, const BodyPlacement& body,
                          double usual_yaw);

}  // namespace holdfast
