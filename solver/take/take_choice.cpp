// SPDX-License-Identifier: MIT
#include "solver/take/take_choice.h"

#include <limits>
#include <numbers>

#include "geometry/body/skeleton.h"

namespace holdfast {

using Eigen::Isometry3d;
using Eigen::Vector3d;

TakeCandidate ChooseTake(const TakePlan& plan, const TakeObject& object, const ArmIk& arm,
                         const BodyPlacement& body) {
  const Vector3d wrist = body.joints.col(arm.Bones().end);
  TakeCandidate best;
  bool first = true;
  for (const TakeCandidate& candidate : plan.candidates) {
    const int yaws = plan.yaw_is_free ? 72 : 1;
    for (int k = 0; k < yaws; ++k) {
      TakeCandidate tried = candidate;
      if (plan.yaw_is_free) tried.yaw_rad = 2.0 * std::numbers::pi * k / yaws;
      const Isometry3d stands = object.Upright(plan.places.front(), tried.yaw_rad);
      ScoreTake(arm, body.joints.col(arm.Bones().root), body.rotation[kSpine3], stands,
                plan.places.front().z(), tried);
      tried.score -= 2.0 * (tried.WristFor(stands).translation() - wrist).norm();
      const bool sounder = tried.fault.empty() && !best.fault.empty();
      const bool worse = !tried.fault.empty() && best.fault.empty();
      if (first || sounder || (!worse && tried.score > best.score)) best = tried;
      first = false;
    }
  }
  return best;
}

UprightPose ComfortableAt(const ArmIk& arm, const TakeCandidate& take, const TakeObject& object,
                          const Vector3d& place, const BodyPlacement& body, double usual_yaw) {
  UprightPose best;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 72; ++k) {
    const double yaw = usual_yaw + 2.0 * std::numbers::pi * k / 72;
    const Isometry3d pose = object.Upright(place, yaw);
    const ArmChoice choice =
        arm.Best({body.joints.col(arm.Bones().root), body.rotation[kSpine3], take.WristFor(pose)});
    const double cost = choice.discomfort + 30.0 * choice.shortfall_m;
    if (cost < least) {
      least = cost;
      best = {pose.translation(), yaw};
    }
  }
  return best;
}

}  // namespace holdfast
