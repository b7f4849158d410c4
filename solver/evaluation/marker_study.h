// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "geometry/io/markers/marker_recording.h"
#include "solver/markers/solve_markers.h"

namespace holdfast {

/// A recording to try, with the static trial of its person (may be null).
struct MarkerTrial {
  std::string name;
  MarkerRecording recording;
  std::shared_ptr<const MarkerRecording> still;
};

struct MarkerStudyOptions {
  int left_out = 1;             ///< markers left out of each trial, one after another; all in turn
  double gap_s = 0.5;           ///< cut into one marker in every two such times; 0: none
  double outlier_share = 0.05;  ///< of all positions, moved by 50 to 200 mm; 0: nor a swap
  double swap_s = 1.0;          ///< for which two markers stand for each other
  std::uint64_t seed = 1;
  int threads = 1;
  SolveMarkersOptions solve;
};

/// Sum of squared distances, and of how many.
struct MarkerErrors {
  double square_sum_mm2 = 0.0;
  int count = 0;
  double Rms_mm() const;
  MarkerErrors& operator+=(const MarkerErrors& other);
};

struct MarkerTrialResult {
  std::string name, fault;  ///< fault: why it was not solved
  int frames = 0;
  double rate_hz = 0.0;
  MarkerErrors residual;
  std::string worst_marker;
  double worst_rms_mm = 0.0;
  struct LeftOut {
    std::string marker;
    MarkerErrors errors;
  };
  std::vector<LeftOut> left_out;
  MarkerErrors gap;     ///< at positions that were cut out
  MarkerErrors change;  ///< of all markers' carried places, for outliers and a swapped pair
  double change_max_mm = 0.0;
  double core_s = 0.0;  ///< of the plain solve, time of its core
};

/// Each trial solved as it is; with one marker left out (its place from the static trial alone);
/// with gaps; with outliers and a pair of swapped labels. Results in the order of the trials, the
/// same on any number of threads but for times. `progress` may stop it: WorkStopped is thrown.
std::vector<MarkerTrialResult> StudyMarkers(const std::vector<MarkerTrial>& trials,
                                            std::shared_ptr<const BodyModel> model,
                                            const MarkerStudyOptions& options,
                                            const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
