// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "geometry/io/markers/marker_recording.h"

namespace holdfast {

/// Markers in text, one line per frame. All functions throw Error, named "`where`:line", for a line
/// with another number of fields than the head, a field that is not a number, and a missing part of
/// the head. A marker whose fields are empty, "nan" or 0 0 0 is not seen.

/// OpenSim's TRC: PathFileType, DataRate and Units in the second and third line, names at every
/// third field of the fourth.
MarkerRecording ParseTrc(std::string_view text, const std::string& where);
/// Vicon Nexus' trajectory export: "Trajectories", the rate, names, axes, units.
MarkerRecording ParseViconCsv(std::string_view text, const std::string& where);
/// Qualisys Track Manager's export: FREQUENCY, MARKER_NAMES, ...; millimeters. With or without a
/// row of column names, with or without frame and time before the positions.
MarkerRecording ParseQtmTsv(std::string_view text, const std::string& where);

}  // namespace holdfast
