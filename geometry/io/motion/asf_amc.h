// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "geometry/io/motion/motion_file.h"

namespace holdfast {

/// Hz; not stated in AMC, CMU recorded at 120 (a few at 60).
inline constexpr double kAmcFrameRate = 120;

/// Reads an Acclaim motion (`.amc`) on the skeleton (`.asf`) next to it, plain or gzipped. Each
/// bone becomes a joint at its start, with the bone's name; a bone without children gets an end
/// site. With C the rotation of a bone's `axis` and M that of its degrees of freedom, both listed
/// in the order of application, the joint rotates by C M C^-1 relative to its parent.
///
/// Throws Error naming file and line for missing or malformed sections, bones outside the
/// hierarchy, loops, unknown bones or degrees of freedom in the motion, truncated frames,
/// non-finite values and no frames; and Error naming the motion if no skeleton is next to it.
SourceMotion ReadAmc(const std::filesystem::path& path);

/// Same for texts in memory; the names are used in messages. `meters_per_unit` 0: from the
/// skeleton's `:units length` (0.45: 0.056444 m). `frame_rate` in Hz.
SourceMotion ParseAmc(std::string_view asf_text, std::string asf_name, std::string_view amc_text,
                      std::string amc_name, double meters_per_unit = 0,
                      double frame_rate = kAmcFrameRate);

/// Finds the skeleton of a motion: the `.asf`/`.asf.gz` in its folder whose name is the longest
/// prefix of the motion's ("07_03.amc.gz": "07.asf.gz"), else the only one in the folder. Throws
/// Error if there is none, or no way to choose.
std::filesystem::path FindAsfBeside(const std::filesystem::path& amc);

}  // namespace holdfast
