// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/import/fields.h"
#include "geometry/io/container/npz.h"

namespace holdfast {

/// Whether these are the fields of an AMASS archive (`trans` with `poses`, or with `root_orient`
/// and `pose_body`) or of a MoSh++ result, its source (`fullpose`, *_stageii.pkl).
bool LooksLikeAmass(const Fields& fields);

/// Whether an archive has the arrays of a clip in a form that ReadClip rejects: rotations as
/// matrices or 6D, joints in a separate dimension, betas per frame, one frame without a frame
/// dimension, no frame rate.
bool NeedsImport(const NpzReader& archive);

/// Imports a motion of AMASS (Mahmood et al., ICCV 2019), z-up, meters.
///   SMPL-X: poses (T,165) or root_orient, pose_body, pose_jaw, pose_eye, pose_hand;
///   SMPL-H: poses (T,156): 22 body joints and 15 per hand; jaw and eyes become zero;
///   SMPL:   poses (T,72): 24 joints, of which the last two (hands) are dropped.
/// Rotations may have any form that ReadRotations accepts. Finger angles are complete: AMASS adds
/// no mean hand. `dmpls` (soft tissue) and the face are dropped. Object arrays like those of a clip
/// are read; without them, the object is taken from a file next to this one (AddObjectBeside). A
/// file without a frame rate is not from AMASS itself: the axis along which the body stands is
/// taken as up, with a warning if that is not z. Throws Error naming the field.
ImportedClip ImportAmass(const Fields& fields, const std::filesystem::path& path,
                         const ParameterOptions& options);

}  // namespace holdfast
