// SPDX-License-Identifier: MIT
#pragma once

/// Terms of one frame of a body whose trunk, arm and head change, one per header. The changed frame
/// (UpperBodyState, 28 numbers x) goes in; residuals in standard deviations and their Jacobians by
/// x come out.
///
/// From the inside out, none needs another:
///   wrist_goal.h    w(x) - target: wrist off its path, metres
///   held_at_face.h  wrist off a place in world or head
///   gaze.h          f(x) - wanted: where the face points
///   trunk_lean.h    chest axes u, f off those wanted
///   balance.h       c(x): middle of mass off the captured one
///   leg_reach.h     |h_k(x) - a_k|: hips too far or too near
///   joint_range.h   joint angles beyond captured limits
#include "solver/terms/body/balance.h"
#include "solver/terms/body/gaze.h"
#include "solver/terms/body/joint_range.h"
#include "solver/terms/body/leg_reach.h"
#include "solver/terms/body/wrist_goal.h"
