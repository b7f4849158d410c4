// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "geometry/io/text_scanner.h"

namespace holdfast {

/// What a rotation and a position of a SourceMotion take.
inline constexpr std::size_t kJointFrameBytes = 56;

/// A joint without channels costs nothing in a text, yet memory in every frame. Throws Error at the
/// scanner's line when `frames` of `joints` would take more than ten times the text they come from
/// and 60 MB, or more than kMaxJointFrames.
void RequireBearable(const TextScanner& scanner, double frames, int joints, std::size_t text_bytes);

}  // namespace holdfast
