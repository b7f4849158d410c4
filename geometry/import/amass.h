// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "geometry/import/fields.h"
#include "geometry/io/container/npz.h"

namespace holdfast {

/// Whether these are the fields of an AMASS archive: `trans` with `poses`, or with `root_orient`
/// and `pose_body`; or of MoSh++'s result, from which they are made (`fullpose`, *_stageii.pkl).
bool LooksLikeAmass(const Fields& fields);

/// Whether an archive with the arrays of a clip holds them as ReadClip does not take them:
/// rotations as matrices or 6D, joints apart, betas a frame, one frame without its dimension, no
/// frame rate.
bool NeedsImport(const NpzReader& archive);

/// A motion of AMASS (Mahmood et al., ICCV 2019), z-up, meters.
///   SMPL-X: poses (T,165) or root_orient, pose_body, pose_jaw, pose_eye, pose_hand;
///   SMPL-H: poses (T,156): 22 body joints and 15 a hand; jaw and eyes become zero;
///   SMPL:   poses (T,72): 24 joints, of which the last two (hands) are dropped.
/// Rotations in every form that ReadRotations takes. Finger angles are complete: AMASS adds no mean
/// hand. `dmpls` (soft tissue) and the face are dropped. An object's arrays, where a clip has them,
/// are read as a clip's; else the object is taken from a file beside it (AddObjectBeside). A file
/// without a frame rate is not AMASS's own: the axis along which the body stands is taken as up,
/// with a warning where that is not z. Throws Error naming the field.
ImportedClip ImportAmass(const Fields& fields, const std::filesystem::path& path,
                         const ParameterOptions& options);

}  // namespace holdfast
