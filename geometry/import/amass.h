// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/import/fields.h"
#include "geometry/import/imported_clip.h"

namespace holdfast {

/// Whether these are the fields of an AMASS archive: `trans` with `poses`, or with `root_orient`
/// and `pose_body`.
bool LooksLikeAmass(const Fields& fields);

/// A motion of AMASS (Mahmood et al., ICCV 2019), z-up, metres.
///   SMPL-X: poses (T,165) or root_orient, pose_body, pose_jaw, pose_eye, pose_hand;
///   SMPL-H: poses (T,156): 22 body joints and 15 a hand; jaw and eyes become zero;
///   SMPL:   poses (T,72): 24 joints, of which the last two (hands) are dropped.
/// Finger angles are complete: AMASS adds no mean hand. `dmpls` (soft tissue) and the face are
/// dropped. An object's arrays, where a clip has them, are read as a clip's. Throws Error naming
/// the field.
ImportedClip ImportAmass(const Fields& fields, const ParameterOptions& options);

}  // namespace holdfast
