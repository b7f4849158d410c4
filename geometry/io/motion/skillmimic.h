// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

#include "geometry/io/container/data_value.h"
#include "geometry/io/motion/motion_file.h"

namespace holdfast {

/// Numbers per frame in SkillMimic's motions.
inline constexpr int kSkillMimicColumns = 337;

/// Whether a file that begins with `head` may hold such a motion: a zip archive of torch.
bool MayBeSkillMimic(std::string_view head);

/// Whether `root` is such a motion: an array (T, 337).
bool LooksLikeSkillMimic(const DataValue& root);

/// Reads a motion of SkillMimic's BallPlay-M (`.pt`, a float tensor (T, 337); Wang et al. 2025): 53
/// joints, 60 Hz, and a ball of radius 0.12 m without rotation as prop. The motion is taken from
/// the root and the rotations (exponential maps). The body positions in the file come from a
/// simulation and are a few centimeters off; they only give the bone lengths. The file's world is z
/// up; the result is y up. Throws Error for other shapes, no frames, and numbers that are not
/// finite.
SourceMotion ReadSkillMimic(const DataValue& root);

}  // namespace holdfast
