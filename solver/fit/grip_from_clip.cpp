// SPDX-License-Identifier: MIT
#include "solver/fit/grip_from_clip.h"

#include <algorithm>

#include "geometry/rotation.h"

namespace holdfast {

GripMaker GripsFromClip(const Clip& clip, std::span<const HandModel* const> hands) {
  return [&clip, hands](const GripRequest& request) {
    const HandModel& hand = **std::ranges::find_if(
        hands, [&](const HandModel* model) { return model->HandSide() == request.side; });
    const int t = request.frame;
    Eigen::Isometry3d recorded = Eigen::Isometry3d::Identity();
    recorded.linear() = ExpSO3(clip.object->orient.col(t));
    recorded.translation() = clip.object->trans.col(t);
    HandState state(hand);
    state.SetBody(clip.pose[static_cast<std::size_t>(t)], clip.trans.col(t));
    Eigen::Isometry3d wrist = Eigen::Isometry3d::Identity();
    wrist.linear() = state.WristRotation();
    wrist.translation() = state.WristPosition();
    const Eigen::Isometry3d target = request.object.Transform() * recorded.inverse() * wrist;
    return GripPose{
        FingersOf(clip.pose[static_cast<std::size_t>(t)], request.side),
        OffsetTo(hand, target, clip.trans.col(t), clip.pose[static_cast<std::size_t>(t)])};
  };
}

}  // namespace holdfast
