// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "geometry/io/motion/motion_file.h"
#include "geometry/io/pickle/data_file.h"

namespace holdfast {

/// Numbers per frame in the motions of SkillMimic and InterMimic.
inline constexpr int kSkillMimicColumns = 337, kInterMimicColumns = 591;

/// Whether a file that begins with `head` may hold a motion in arrays: a zip archive of torch or
/// numpy.
bool MayBeArrayMotion(std::string_view head);

/// Whether a file holds a motion on its own skeleton, in arrays: a tensor (T, 337) or (T, 591), or
/// `posed_joints` and `global_rot_mats` of 77 or 30 joints.
bool LooksLikeArrayMotion(const DataFile& file);

/// Reads it; the result is y-up, in meters. Throws Error for other shapes, no frames, and numbers
/// that are not finite.
///   SkillMimic's BallPlay-M (Wang et al. 2025; .pt): 53 joints, 60 Hz, and a ball of radius 0.12 m
///     without rotation as prop. z-up.
///   InterMimic (Xu et al. 2025; .pt): 52 joints, 30 Hz, and an object, named as in the file's name
///     (sub3_largetable_006.pt), whose mesh the file does not have. z-up.
///   Kimodo (2026; .npz): SOMA's skeleton of 77 or 30 joints, 30 Hz. y-up.
/// Root and rotations give the motion. Positions of the other joints only give the bone lengths:
/// those of a simulation are a few centimeters off.
SourceMotion ReadArrayMotion(const DataFile& file);

}  // namespace holdfast
