// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/fit/prepared_object.h"

namespace holdfast {

/// Criteria for an object following a hand, regardless of skin and fingers: they are near each
/// other and move together. On SkillMimic's basketball clips (61; 6 cm from the nearest joint
/// instead of the skin), precision against the contact labels is 94 % and recall 96 %; with 0.8 m/s
/// they are 95 % and 87 %, and most dribbling is missed.
struct FollowProtocol {
  double gap_m = 0.05;     ///< maximum distance from hand skin to object; inside counts as 0
  double speed_m_s = 1.5;  ///< maximum speed of its center relative to the middle finger's root
  double window_s = 0.05;  ///< to either side, for speeds (least-squares slopes)
  double least_s = 0.1;    ///< shorter intervals are ignored
  double lying_m = 0.05;   ///< an object at most this high above the ground
  double lying_m_s = 0.1;  ///< and slower than this rests there and follows no hand
};

/// Bits as in Clip::holding_hand, per frame: hands that the object follows. Does not need the
/// object's rotation. The result does not depend on `threads`. Throws Error for a clip without an
/// object track.
std::vector<std::uint8_t> FindFollows(const Clip& clip, std::span<const HandModel* const> hands,
                                      const PreparedObject& object,
                                      const FollowProtocol& protocol = {}, int threads = 1);

/// Distance from the skin of a hand in the clip to the object, meters, per frame; negative inside.
std::vector<double> SkinGaps(const Clip& clip, const HandModel& hand, const PreparedObject& object,
                             int threads = 1);

}  // namespace holdfast
