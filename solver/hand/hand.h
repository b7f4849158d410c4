// SPDX-License-Identifier: MIT
#pragma once

/// A hand in anatomical terms: a HandModel of SMPL-X's layout goes in; joint angles with their
/// ranges, the parts of the skin that touch, and postures to begin from come out.
#include "solver/hand/hand_landmarks.h"
#include "solver/hand/hand_postures.h"
