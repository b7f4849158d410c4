// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "geometry/io/markers/marker_recording.h"

namespace holdfast {

/// Whether bytes begin like a C3D file: the number of its first block of parameters, then 0x50.
bool LooksLikeC3d(std::string_view head);

/// The points of a C3D file (www.c3d.org, user guide of 2008): integers or floats, byte orders of
/// Intel, MIPS and DEC with its floats, labels of more than 255 points (LABELS2, ...), frames of
/// more than 65,535 (TRIAL:ACTUAL_END_FIELD). A point is not seen where its residual is negative.
/// Names go to POINT:LABELS; points without one are called "point 7". Throws Error, named `where`,
/// for a file that is cut off or contradicts itself.
MarkerRecording ParseC3d(std::string_view bytes, const std::string& where);

}  // namespace holdfast
