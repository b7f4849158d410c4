// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/io/markers/marker_recording.h"
#include "solver/markers/solve_markers.h"

namespace holdfast {

/// The recording as its solve understood it, in its axes, meters: labels that stood for each other
/// changed back, a wrong unit put right, outliers and gaps of the body's markers filled with where
/// the body carries them, of the object's with where the object does, moved by how far the marker
/// is from there at either end of the gap (in between linearly). Markers whose names are not known
/// stay as they are.
MarkerRecording RepairedMarkers(const MarkerRecording& recording, const SolvedRecording& solved);

}  // namespace holdfast
