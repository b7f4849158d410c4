// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/body/hand_model.h"
#include "solver/actions/action_grasps.h"

namespace holdfast {

/// What hands choose from that carry an action: grasps of one hand, how many of them a grasp of the
/// other hand is found for, and the vertices of the object that both are found on.
inline constexpr int kGraspChoice = 14, kPairTries = 5, kPairVertices = 300;

/// Two hands that can hold the object at once: what it changes hands with.
struct GraspPair {
  Grasp right, left;
};

/// Grasps of the left hand that takes the object over from the right one (TransferGrasp) before the
/// chest of a person who stands upright, the object upright in whichever turn suits both arms. The
/// right hand's most comfortable grasps there are tried first, `tries` of them; kept are pairs that
/// leave both wrists within their limits.
std::vector<GraspPair> FindGraspPairs(const HandModel& right_hand, const HandModel& left_hand,
                                      const ActionObject& object, const std::vector<Grasp>& right,
                                      std::uint64_t seed, int tries);

}  // namespace holdfast
