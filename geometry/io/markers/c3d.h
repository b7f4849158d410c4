// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "geometry/io/markers/marker_recording.h"

namespace holdfast {

/// Whether bytes begin like a C3D file: the number of its first parameter block, then 0x50.
bool LooksLikeC3d(std::string_view head);

/// Reads the points of a C3D file (www.c3d.org, user guide of 2008): integers or floats, byte
/// orders of Intel, MIPS and DEC with its floats, labels of more than 255 points (LABELS2, ...),
/// more than 65,535 frames (TRIAL:ACTUAL_END_FIELD). A point with a negative residual is not seen.
/// Names come from POINT:LABELS; points without one are called "point 7". Throws Error, named
/// `where`, for a file that is truncated or contradicts itself.
MarkerRecording ParseC3d(std::string_view bytes, const std::string& where);

/// Encodes a recording as a C3D file (www.c3d.org, user guide of 2008): floats, Intel's byte order,
/// millimeters, the recording's axes; residual 0, or -1 if a marker is not seen. Labels are
/// "subject:name" if there is a subject; more than 255 go to LABELS2 and so on, more than 65,535
/// frames to TRIAL:ACTUAL_END_FIELD. Throws Error, named `where`, for what the format cannot hold:
/// no marker or frame, labels of more than 127 bytes or none, more than 127 KB of parameters.
std::string C3dBytes(const MarkerRecording& recording, const std::string& where);

/// Same, written atomically to a file.
void WriteC3d(const MarkerRecording& recording, const std::filesystem::path& path);

}  // namespace holdfast
