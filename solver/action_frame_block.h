// SPDX-License-Identifier: MIT
#pragma once

#include "solver/frame_block.h"
#include "solver/terms/balance.h"
#include "solver/terms/gaze.h"
#include "solver/terms/held_at_face.h"
#include "solver/terms/joint_range.h"
#include "solver/terms/leg_reach.h"
#include "solver/terms/trunk_lean.h"

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
