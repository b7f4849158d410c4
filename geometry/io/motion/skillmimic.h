// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string_view>

#include "geometry/io/container/data_value.h"
#include "geometry/io/motion/motion_file.h"

namespace holdfast {

/// Numbers a frame of SkillMimic's motions.
inline constexpr int kSkillMimicColumns = 337;

/// Whether a file that begins with `head` may hold such a motion: a zip archive of torch.
bool MayBeSkillMimic(std::string_view head);

/// Whether `root` is one: an array (T, 337).
bool LooksLikeSkillMimic(const DataValue& root);

/// Reads a motion of SkillMimic's BallPlay-M (`.pt`, a float tensor (T, 337); Wang et al. 2025): 53
/// joints, 60 Hz, and a ball of radius 0.12 m without rotation as prop. Root, then rotations as
/// exponential maps, are taken; the positions of bodies in the file, which are those of a
/// simulation and a few centimeters off, give the lengths of bones alone. The file's world is z up;
/// what comes out is y up. Throws Error for other shapes, no frames, and numbers that are not
/// finite.
SourceMotion ReadSkillMimic(const DataValue& root);
/// The same for a file. Throws Error also for a file that is something else.
SourceMotion ReadSkillMimic(const std::filesystem::path& path);

}  // namespace holdfast
