// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/parallel.h"
#include "solver/fit/prepared_object.h"
#include "solver/markers/solve_markers.h"

namespace holdfast {

inline constexpr double kMarkerTouch_m = 0.03;  ///< a fingertip's marker this near touches
inline constexpr double kSkinTouch_m = 0.003;   ///< skin this near touches

/// Touches of an object that the markers show, and what solved and refined motion have of them.
struct TouchStudy {
  std::vector<std::pair<int, int>> touches;  ///< frames [begin, end), by fingertips' markers
  int found = 0;                             ///< of them: the solved hand's skin touches
  int kept = 0;                              ///< of them: the refined hand's skin still does
  int more = 0;                              ///< touches of the solved hand that no marker shows
  int frames = 0;
  int deep_solved = 0, deep_refined = 0;  ///< frames deeper than kDeep_mm, both ways
  double deepest_solved_mm = 0.0, deepest_refined_mm = 0.0;
};

/// Touches in a recording that was solved with its object: frames in which a fingertip's marker is
/// near the object, gaps of 0.2 s passed; found where the skin touches in one of their frames. The
/// clip is then refined (RefineCarried). Where no hand gets to the object nothing is found.
/// `progress` may stop it: WorkStopped is thrown. Does not depend on `threads`.
TouchStudy StudyTouches(const MarkerRecording& recording, const SolvedRecording& solved,
                        std::shared_ptr<const BodyModel> model, const PreparedObject& object,
                        int threads, const StagedProgress& progress = {});

}  // namespace holdfast
