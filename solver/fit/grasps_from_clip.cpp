// SPDX-License-Identifier: MIT
#include "solver/fit/grasps_from_clip.h"

#include <algorithm>

namespace holdfast {

GraspMaker GraspsFromClip(const Clip& clip, std::span<const HandModel* const> hands) {
  return [&clip, hands](const GraspRequest& request) {
    const HandModel& hand = **std::ranges::find_if(
        hands, [&](const HandModel* model) { return model->HandSide() == request.side; });
    const int t = request.frame;
    HandState state(hand);
    state.SetBody(clip.pose[static_cast<std::size_t>(t)], clip.trans.col(t));
    const Eigen::Isometry3d target =
        request.object.Transform() * clip.object->Pose(t).inverse() * state.WorldFromWrist();
    return GraspPose{
        FingersOf(clip.pose[static_cast<std::size_t>(t)], request.side),
        OffsetTo(hand, target, clip.trans.col(t), clip.pose[static_cast<std::size_t>(t)])};
  };
}

}  // namespace holdfast
