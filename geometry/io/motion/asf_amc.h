// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "geometry/io/motion/motion_file.h"

namespace holdfast {

struct AmcOptions {
  std::filesystem::path skeleton;  ///< the `.asf`; empty: looked for beside the motion
  double meters_per_unit = 0;      ///< 0: from the skeleton's `:units length` (0.45: 0.056444 m)
  double frame_rate = 120;         ///< Hz; AMC does not say, CMU recorded at 120 (a few at 60)
};

/// Reads an Acclaim motion (`.amc`) on its skeleton (`.asf`), plain or gzip'd. Each bone becomes a
/// joint at its start, of the bone's name; a bone that nothing hangs on gets an end site. With C
/// the rotation of a bone's `axis` and M that of its degrees of freedom, both listed first-applied
/// first, the joint turns by C M C^-1 relative to its parent.
///
/// Throws Error naming file and line: sections missing or malformed, bones without a place in the
/// hierarchy, loops, unknown bones or degrees of freedom in the motion, frames cut short, values
/// that are not finite, no frames; and Error naming the motion when no skeleton lies beside it.
SourceMotion ReadAmc(const std::filesystem::path& path, const AmcOptions& options = {});

/// The same for texts in memory; the names are how messages call them.
SourceMotion ParseAmc(std::string_view asf_text, std::string asf_name, std::string_view amc_text,
                      std::string amc_name, const AmcOptions& options = {});

/// The skeleton that belongs to a motion: the only `.asf`/`.asf.gz` in its folder whose name is a
/// prefix of the motion's ("07_03.amc.gz": "07.asf.gz"), the longest such, else the only one there.
/// Throws Error when there is none, or no way to choose.
std::filesystem::path FindAsfBeside(const std::filesystem::path& amc);

}  // namespace holdfast
