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
  static constexpr int kRows = HeldAtFace::kRows + Gaze::kRows + TrunkLean::kRows +
                               LegReach::kRows + Balance::kRows + JointRange::kRows;

  HeldAtFace hand;
  Gaze gaze;
  TrunkLean lean;
  LegReach legs;
  Balance balance;
  JointRange range;

  template <typename Visit>
  void ForEach(const Visit& visit) const {
    visit(hand);
    visit(gaze);
    visit(lean);
    visit(legs);
    visit(balance);
    visit(range);
  }
};
using ActionFrameBlock = FrameBlock<ActionFrameTerms>;

}  // namespace holdfast
