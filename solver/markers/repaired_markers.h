// SPDX-License-Identifier: MIT
#pragma once

#include "geometry/io/markers/marker_recording.h"
#include "solver/markers/solve_markers.h"

namespace holdfast {

/// Returns the recording as interpreted by its solve, in its axes, meters: exchanged labels swapped
/// back, a wrong unit corrected, and outliers and gaps filled. Body markers are filled with the
/// positions predicted by the body, object markers by the object, plus an offset that interpolates
/// linearly between the deviations at both ends of the gap. Unknown markers are unchanged.
MarkerRecording RepairedMarkers(const MarkerRecording& recording, const SolvedRecording& solved);

}  // namespace holdfast
