// SPDX-License-Identifier: MIT
#pragma once

/// A hand in anatomical terms: a HandModel of SMPL-X's layout goes in; joint angles with their
/// ranges, the parts of the skin that touch, and postures to begin from come out.
///
/// From the inside out:
///   hand_axes.h        flexion, spread, twist of joints; their ranges
///   hand_evaluation.h  vertices and Jacobians, once per finger pose
///   point_patches.h    points whose least distance is asked for
///   hand_landmarks.h   pads, skin points, finger balls, self-penetration
///   hand_postures.h    open and pinching hands; HandAnatomy: all of these
#include "solver/hand/hand_landmarks.h"
#include "solver/hand/hand_postures.h"
