// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/import/imported_clip.h"
#include "geometry/io/container/data_value.h"

namespace holdfast {

/// Parameters as one array without names, told by their number a frame:
///   322: Motion-X (Lin et al., 2023): root 3, body 63, hands 90, jaw 3, expression 50, face shape
///        100, trans 3, betas 10; y-up, 30 Hz
///   165: the 55 joints of SMPL-X, axis-angle or any form of ReadRotations; no translation
///   156: the 52 of SMPL-H, likewise
/// Features of HumanML3D (263), KIT-ML (251) and HumanTOMATO (623), and joint positions, hold no
/// rotations of this skeleton and are refused by name; so is ARCTIC's object (7) without its body.
/// Throws Error for every other shape.
ImportedClip ImportParameterArray(const DataValue& value, const ParameterOptions& options);

}  // namespace holdfast
