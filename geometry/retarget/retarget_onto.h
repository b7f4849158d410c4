// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/clip/clip.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/retarget/retarget.h"
#include "geometry/retarget/skeleton_map.h"

namespace holdfast {

/// Inverse of Retarget: transfers a clip's motion to another skeleton. `character` (y up) provides
/// its joints, rest pose and a sample motion; the result has the clip's frames. Bone directions and
/// rolls are the clip's; the path of the hips is scaled by leg length. Joints without a counterpart
/// in SMPL-X follow their parent; those above the hips are constant. For a skeleton with SMPL-X's
/// rest pose, rotations are copied.
///
/// The clip's object becomes the prop, without its mesh. In frames in which a hand holds it
/// (`holding_hand`), it keeps its pose relative to that wrist. Throws Error as Retarget does.
SourceMotion RetargetOnto(const Clip& clip, const RetargetBody& body, const SourceMotion& character,
                          const SkeletonMap& map);

}  // namespace holdfast
