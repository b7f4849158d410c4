// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "generator/matching/body_frame.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/take/take_path.h"
#include "solver/take/take_plan.h"

namespace holdfast {

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
