// SPDX-License-Identifier: MIT
#pragma once

/// What the released code of IMoS does, for comparison with the paper and with FitClip. Clip, hand
/// and object go in; a FitResult comes out.
///
/// From the inside out:
///   adam.h              Adam, moments kept between calls
///   rotation_6d.h       two rows of R, Gram-Schmidt
///   imos_finger_loss.h  the finger loss and its gradient
///   imos_code.h         FitClipImosCode: object first, then fingers
#include "solver/recipes/imos_code.h"
#include "solver/recipes/imos_finger_loss.h"
