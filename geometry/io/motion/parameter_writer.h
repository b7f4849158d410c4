// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "geometry/body/body_layouts.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// What the arrays of a parameter file are called.
enum class ParameterLayout {
  kAmass,   ///< AMASS: SMPL-X in parts, which is a clip; SMPL-H as `poses (T,156)`
  kPackage  ///< the smplx package's arguments: global_orient, body_pose, left_hand_pose, transl ...
};

/// Writes a motion's parameters for a family of models, `.npz` (float64) or `.json` by the path's
/// extension, atomically.
///
/// kAmass: SMPL-X and MANO are clips (WriteClip); SMPL-H is `poses` (T,156), `trans` (T,3),
/// `betas`, `gender`, `mocap_framerate`.
/// kPackage: `global_orient` (T,3), `transl` (T,3), `betas` (1,B), and for SMPL-X and SMPL-H
/// `body_pose` (T,63), `left_hand_pose` and `right_hand_pose` (T,45); SMPL-X has `jaw_pose`,
/// `leye_pose`, `reye_pose` (T,3) besides, MANO `hand_pose` (T,45) alone. Beside them
/// `flat_hand_mean`, which says what the finger angles are, `model_type`, `gender`, `fps`.
///
/// `clip` holds finger angles as they are to be written. Throws Error for another extension, and
/// for kAmass as `.json`.
void WriteParameters(const Clip& clip, ModelKind kind, ParameterLayout layout, bool flat_hand_mean,
                     const std::filesystem::path& path);

}  // namespace holdfast
