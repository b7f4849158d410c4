// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "geometry/io/markers/marker_recording.h"

namespace holdfast {

/// Markers in text, a line a frame. All throw Error, named "`where`:line", for a line that has
/// another number of fields than the head, a field that is no number, and a missing part of the
/// head. Empty fields (and in Qualisys' "nan", or 0 0 0) are markers that are not seen.

/// OpenSim's TRC: PathFileType, DataRate and Units in the second and third line, names every three
/// fields in the fourth.
MarkerRecording ParseTrc(std::string_view text, const std::string& where);
/// Vicon Nexus' export of trajectories: "Trajectories", the rate, names, axes, units.
MarkerRecording ParseViconCsv(std::string_view text, const std::string& where);
/// Qualisys Track Manager's: FREQUENCY, MARKER_NAMES, ...; millimeters. With a row of column names
/// or without, with frame and time before the positions or without.
MarkerRecording ParseQtmTsv(std::string_view text, const std::string& where);

}  // namespace holdfast
