// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include "geometry/io/markers/marker_recording.h"

namespace holdfast {

/// A recording as a C3D file (www.c3d.org, user guide of 2008): floats, Intel's byte order,
/// millimetres, its axes; residual 0, or -1 where a marker is not seen. Labels are
/// "subject:name" where there is a subject; more than 255 go to LABELS2 and so on, more than 65,535
/// frames to TRIAL:ACTUAL_END_FIELD. Throws Error, named `where`, for what the format can't hold:
/// no marker or frame, labels of more than 127 bytes or none, more parameters than 127 KB.
std::string C3dBytes(const MarkerRecording& recording, const std::string& where);

/// The same, written atomically.
void WriteC3d(const MarkerRecording& recording, const std::filesystem::path& path);

}  // namespace holdfast
