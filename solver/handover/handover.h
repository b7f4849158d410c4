// SPDX-License-Identifier: MIT
#pragma once

/// Who holds the object, and how it changes hands. A clip, with or without its object, goes in;
/// holding_hand per frame, the switches, and the grasp of the receiving hand come out.
///
/// From the inside out:
///   viterbi.h             ViterbiPath: likeliest sequence of states, posteriors
///   holds.h               FindHolds: who holds a tracked object
///   dwell_fit.h           FitDwell: when two hands come together and part
///   handover_search.h     FindHandovers: switches without an object
///   hand_balls.h          HandBalls: a hand as balls
///   grasp_transfer.h      TransferGrasp: the receiving hand's grasp
///   grasps_by_transfer.h  those grasps, asked for by FitClip
///   hand_meeting.h        LetHandsMeet: both arms go half the way
///   passage_clearance.h   PassageClearance: how deep a hand is on its way, how far it keeps off
///   passage_easing.h      EasedWay: the same way with less acceleration
///   hand_passage.h        ClearPassages: clear ways to holds and away from them
#include "solver/handover/grasps_by_transfer.h"
#include "solver/handover/hand_meeting.h"
#include "solver/handover/handover_search.h"
#include "solver/handover/holds.h"
