// SPDX-License-Identifier: MIT
#pragma once

/// Measures of whole motions: clips come in; joint errors, smoothness, gait and style come out,
/// and how far sets of motions are from captured ones.
///
/// From the inside out:
///   sample_statistics.h  mean and quantiles
///   power_spectrum.h     power over frequency (Welch)
///   way_pace.h           how a way spreads over time
///   hand_way.h           how a hand gets to where it goes
///   gait.h               stances and strides
///   joint_error.h        errors of joints and fingertips
///   motion_metrics.h     speed, acceleration, jerk, foot skating
///   reach_faults.h       second crouches, leaning back
///   set_spread.h         SetSpread: how much motions of a set differ
///   motion_style.h       measures and curves of a walk
///   style_comparison.h   distances between sets of motions
///   motion_set.h         the clips of a set
///   naturalness.h        CompareNaturalness: sets against captured motion
#include "generator/walk_statistics/joint_error.h"
#include "generator/walk_statistics/motion_metrics.h"
#include "generator/walk_statistics/motion_set.h"
#include "generator/walk_statistics/naturalness.h"
