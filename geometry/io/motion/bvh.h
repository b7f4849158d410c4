// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "geometry/io/motion/motion_file.h"

namespace holdfast {

/// Reads a Biovision hierarchy (`.bvh`, plain or gzip'd). Channels in any order and number; the
/// rotation of a joint is the product of its rotation channels from left to right. A position
/// channel stands in for that number of OFFSET. Lengths times `metres_per_unit` are metres
/// (BVH has no unit; centimetres are the custom). Names may hold blanks and may repeat.
/// A header that miscounts by one whole frame is noted, not refused.
///
/// Throws Error naming file and line: not a BVH, unknown or repeated channels, unbalanced braces,
/// several roots, no frames, a frame with missing or surplus numbers, values that are not finite,
/// a frame time that is not positive, more than 1,000 joints.
SourceMotion ReadBvh(const std::filesystem::path& path, double metres_per_unit = 0.01);

/// The same for text in memory; `name` is how messages call it.
SourceMotion ParseBvh(std::string_view text, std::string name, double metres_per_unit = 0.01);

}  // namespace holdfast
