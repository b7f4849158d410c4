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
/// and those of a whole pose (FreePose), Ceres cost functions:
///   marker_distance.h    markers off where the body carries them
///   marker_on_skin.h     markers off their height over the skin
///   marker_place.h       markers off where their names say they sit; betas
///   pose_rest.h          joints off their rest, or beyond their limits
///   pose_acceleration.h  q_t-1 - 2 q_t + q_t+1
///   pelvis_upright.h     a pelvis that leans
///   head_place.h         lips off a place, points in the head
#include "solver/terms/body/balance.h"
#include "solver/terms/body/gaze.h"
#include "solver/terms/body/head_place.h"
#include "solver/terms/body/joint_range.h"
#include "solver/terms/body/leg_reach.h"
#include "solver/terms/body/marker_distance.h"
#include "solver/terms/body/marker_place.h"
#include "solver/terms/body/pelvis_upright.h"
#include "solver/terms/body/pose_acceleration.h"
#include "solver/terms/body/pose_rest.h"
#include "solver/terms/body/wrist_goal.h"
