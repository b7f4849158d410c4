// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string_view>

#include "geometry/io/container/text_scanner.h"
#include "geometry/io/motion/motion_file.h"

namespace holdfast {

/// What a rotation and a position of a SourceMotion take.
inline constexpr std::size_t kJointFrameBytes = 56;

/// A joint without channels costs nothing in a text, yet memory in every frame. Throws Error at the
/// scanner's line when `frames` of `joints` would take more than ten times the text they come from
/// and 60 MB, or more than kMaxJointFrames.
void RequireBearable(const TextScanner& scanner, double frames, int joints, std::size_t text_bytes);

/// Throws Error (`where`, with the field and the frame) for the first number that is outside the
/// ranges of geometry/value_ranges.h or no number.
void RequireInRange(const SourceMotion& motion, std::string_view where);

}  // namespace holdfast
