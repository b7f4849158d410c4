// SPDX-License-Identifier: MIT
#pragma once

#include "solver/body_ik/frame_block.h"
#include "solver/terms/body/balance.h"
#include "solver/terms/body/gaze.h"
#include "solver/terms/body/joint_range.h"
#include "solver/terms/body/leg_reach.h"
#include "solver/terms/body/wrist_goal.h"

namespace holdfast {

/// All that is asked of one frame of a reach: 20 residuals.
struct ReachFrameTerms {
  WristGoal wrist;
  Gaze gaze;
  LegReach legs;
  Balance balance;
  JointRange range;

  auto Tied() const { return std::tie(wrist, gaze, legs, balance, range); }
};
using ReachFrameBlock = FrameBlock<ReachFrameTerms>;

}  // namespace holdfast
