// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/motion/motion_file.h"

namespace holdfast {

/// Reads a Biovision hierarchy (`.bvh`, plain or gzip'd). Channels in any order and number; the
/// rotation of a joint is the product of its rotation channels from left to right. A position
/// channel stands in for that number of OFFSET. Lengths times `meters_per_unit` are meters
/// (BVH has no unit; centimeters are the custom). Names may hold blanks and may repeat.
/// Noted, not refused: a header that announces more frames than there are, or one less; decimal
/// commas; several roots, of which the tree with the most joints is taken; UTF-16, a byte order
/// mark and lines that end in carriage returns alone.
///
/// Throws Error naming file and line: not a BVH, unknown or repeated channels, unbalanced braces,
/// no frames, a frame with missing or surplus numbers, values that are not finite,
/// a frame time that is not positive, more than 1,000 joints.
SourceMotion ReadBvh(const std::filesystem::path& path, double meters_per_unit = 0.01);

/// The same for text in memory, as PlainText gives it; `name` is how messages call it.
SourceMotion ParseBvh(std::string_view text, std::string name, double meters_per_unit = 0.01);

/// The clip's 55 joints as a Biovision hierarchy, offsets those of the shaped body in its T-pose.
/// Lengths are centimeters, world y up (x, z, -y of the clip), as most programs expect. The root
/// has position and rotation channels, all others rotation only, as Z X Y Euler angles (R = Rz Rx
/// Ry) in degrees that go on smoothly from frame to frame. End sites lie on the skin: the vertex of
/// the joint farthest from it. The joint positions of the text are the clip's within a micrometer.
std::string BvhText(const Clip& clip, const BodySurface& surface);

/// Writes BvhText atomically.
void WriteBvh(const Clip& clip, const BodySurface& surface, const std::filesystem::path& path);

}  // namespace holdfast
