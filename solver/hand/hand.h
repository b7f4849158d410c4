// SPDX-License-Identifier: MIT
#pragma once

/// Hand anatomy. Input: a HandModel with SMPL-X's layout. Output: joint angles with their ranges,
/// parts of the skin that touch, and initial postures.
#include "solver/hand/hand_landmarks.h"
#include "solver/hand/hand_postures.h"
