// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/clip/clip.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/retarget/retarget.h"
#include "geometry/retarget/skeleton_map.h"

namespace holdfast {

/// The way back from Retarget: a clip's motion on another skeleton. `character` (y up) tells its
/// joints, its rest pose and what it has moved like; the result has the clip's frames. Bone
/// directions and rolls are the clip's, the path of the hips is scaled by leg length, joints that
/// stand for none of SMPL-X's follow their parent; those above the hips stay where they are. A
/// skeleton that rests like SMPL-X takes rotation by rotation.
///
/// The clip's object becomes the prop, without its mesh: in frames in which a hand holds it
/// (`holding_hand`), it keeps its place relative to that wrist. Throws Error as Retarget does.
SourceMotion RetargetOnto(const Clip& clip, const RetargetBody& body, const SourceMotion& character,
                          const SkeletonMap& map);

}  // namespace holdfast
