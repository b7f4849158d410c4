// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "geometry/body/body_model.h"
#include "geometry/clip/clip.h"
#include "geometry/io/motion/motion_file.h"

namespace holdfast {

/// Reads a Biovision hierarchy (`.bvh`, plain or gzipped). Channels may have any order and number;
/// the rotation of a joint is the product of its rotation channels from left to right. A position
/// channel replaces that number of OFFSET. Lengths times `meters_per_unit` are meters (BVH has no
/// unit; centimeters are customary). Names may contain blanks and may repeat. Noted, not rejected:
/// a header that states more frames than there are, or one less; decimal commas; several roots, of
/// which the tree with the most joints is taken; UTF-16, a byte order mark, and lines that end in
/// lone carriage returns.
///
/// Throws Error naming file and line for a file that is not a BVH, unknown or repeated channels,
/// unbalanced braces, no frames, missing or surplus numbers in a frame, values that are not finite,
/// a frame time that is not positive, and more than 1,000 joints.
SourceMotion ReadBvh(const std::filesystem::path& path, double meters_per_unit = 0.01);

/// Same for text in memory, as returned by PlainText; `name` is used in messages.
SourceMotion ParseBvh(std::string_view text, std::string name, double meters_per_unit = 0.01);

/// Returns the clip's 55 joints as a Biovision hierarchy, with the offsets of the shaped body in
/// its T-pose. Lengths are centimeters, world y up (x, z, -y of the clip), as most programs expect.
/// The root has position and rotation channels, all other joints rotations only, as Z X Y Euler
/// angles (R = Rz Rx Ry) in degrees, continuous over the frames. End sites are on the skin: the
/// vertex of the joint farthest from it. Joint positions are the clip's within a micrometer.
std::string BvhText(const Clip& clip, const BodySurface& surface);

/// Writes BvhText atomically.
void WriteBvh(const Clip& clip, const BodySurface& surface, const std::filesystem::path& path);

}  // namespace holdfast
