// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Geometry>

#include "geometry/body/hand_model.h"
#include "geometry/clip/clip.h"
#include "solver/handover/grasps_by_transfer.h"
#include "solver/handover/holds.h"
#include "solver/unknowns/wrist_offset.h"

namespace holdfast {

/// How two wrists leave the clip's to hold one object, each in its own frame.
struct HandMeeting {
  WristOffset giver, receiver;
};

/// The wrists that are as far apart as a hand-over needs and nearest to where they are:
///
///   min E(R_g', p_g'; R_g, p_g) + E(R_r', p_r'; R_r, p_r)   (ObjectData)
///
/// where (R_g', p_g')^-1 (R_r', p_r') = `giver_from_receiver`; `giver` (R_g, p_g) and `receiver`
/// are the world poses of the clip's wrists, metres. So both move by the same length.
HandMeeting ShareTheWay(const Eigen::Isometry3d& giver, const Eigen::Isometry3d& receiver,
                        const Eigen::Isometry3d& giver_from_receiver);

/// Both arms of `clip` go to where its hands meet for each hand-over (ShareTheWay), stay there
/// while both hold, and come and go smoothly (minimum jerk over up to 1 s, not before both last
/// held). Without 0.3 s to come, and for hand-overs of no switch, the clip stays as it is.
void LetHandsMeet(const HandModel& right, const HandModel& left,
                  std::span<const HandSwitch> switches, std::span<const Handover> handovers,
                  Clip& clip);

/// How far `hand`'s wrist is in `to` from where `from` has it, in frames [begin, end).
WristChange LargestChange(const HandModel& hand, const Clip& from, const Clip& to, int begin,
                          int end);

}  // namespace holdfast
