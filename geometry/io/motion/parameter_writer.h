// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "geometry/body/body_layouts.h"
#include "geometry/clip/clip.h"

namespace holdfast {

/// Names of the arrays in a parameter file.
enum class ParameterLayout {
  kAmass,   ///< AMASS: SMPL-X in parts, which is a clip; SMPL-H as `poses (T,156)`
  kPackage  ///< the smplx package's arguments: global_orient, body_pose, left_hand_pose, transl ...
};

/// Writes a motion's parameters for a family of models, as `.npz` (float64) or `.json` by the
/// path's extension, atomically.
///
/// kAmass: SMPL-X and MANO are clips (WriteClip); SMPL-H is `poses` (T,156), `trans` (T,3),
/// `betas`, `gender`, `mocap_framerate`.
/// kPackage: `global_orient` (T,3), `transl` (T,3), `betas` (1,B); for SMPL-X and SMPL-H also
/// `body_pose` (T,63), `left_hand_pose` and `right_hand_pose` (T,45); for SMPL-X also `jaw_pose`,
/// `leye_pose`, `reye_pose` (T,3); for MANO only `hand_pose` (T,45). In addition `flat_hand_mean`,
/// the convention of the finger angles, `model_type`, `gender`, `fps`.
///
/// `clip` holds the finger angles as they are written. Throws Error for another extension, and for
/// kAmass as `.json`.
void WriteParameters(const Clip& clip, ModelKind kind, ParameterLayout layout, bool flat_hand_mean,
                     const std::filesystem::path& path);

}  // namespace holdfast
