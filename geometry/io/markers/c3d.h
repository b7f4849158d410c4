// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
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

/// A recording as a C3D file (www.c3d.org, user guide of 2008): floats, Intel's byte order,
/// millimeters, its axes; residual 0, or -1 where a marker is not seen. Labels are
/// "subject:name" where there is a subject; more than 255 go to LABELS2 and so on, more than 65,535
/// frames to TRIAL:ACTUAL_END_FIELD. Throws Error, named `where`, for what the format can't hold:
/// no marker or frame, labels of more than 127 bytes or none, more parameters than 127 KB.
std::string C3dBytes(const MarkerRecording& recording, const std::string& where);

/// The same, written atomically.
void WriteC3d(const MarkerRecording& recording, const std::filesystem::path& path);

}  // namespace holdfast
