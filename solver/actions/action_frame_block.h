// SPDX-License-Identifier: MIT
#pragma once

#include "solver/body_ik/frame_block.h"
#include "solver/terms/body/balance.h"
#include "solver/terms/body/gaze.h"
#include "solver/terms/body/held_at_face.h"
#include "solver/terms/body/joint_range.h"
#include "solver/terms/body/leg_reach.h"
#include "solver/terms/body/trunk_lean.h"

namespace holdfast {

/// All that is asked of a body in one frame of an action: 26 residuals.
struct ActionFrameTerms {
  HeldAtFace hand;
  Gaze gaze;
  TrunkLean lean;
  LegReach legs;
  Balance balance;
  JointRange range;

  auto Tied() const { return std::tie(hand, gaze, lean, legs, balance, range); }
};
using ActionFrameBlock = FrameBlock<ActionFrameTerms>;

}  // namespace holdfast
