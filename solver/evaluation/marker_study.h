// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "geometry/io/markers/marker_recording.h"
#include "solver/carry/carry.h"
#include "solver/evaluation/touch_study.h"
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
  /// What solve.object's markers are on: touches are studied; null: not.
  std::shared_ptr<const PreparedObject> object;
  /// Put into the hand of those who drink (CarryOptions::drink); null: nothing.
  std::shared_ptr<const PreparedObject> cup;
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
  std::optional<TouchStudy> touches;
  HeadReport head;                   ///< of the plain solve
  std::optional<DrinkReport> drink;  ///< of those who drink, with MarkerStudyOptions::cup
  DrinkMeasures drunk;               ///< in the fitted clip
  double in_hand_mm = 0.0;           ///< there: mean over held frames of the deepest skin in it
  int in_body_frames = 0;            ///< there: deeper than 2 mm in the own body

  double Speed() const { return frames / core_s; }  ///< frames a second
};

/// What all trials that were solved come to. Trials are places in the list.
struct MarkerStudySums {
  MarkerErrors residual, left_out, gap, change;
  std::map<std::string, MarkerErrors> of_left_out;  ///< by marker
  std::optional<std::size_t> worst, worst_change, slowest;
  double seconds = 0.0, core_s = 0.0;
  int solved = 0;
};
MarkerStudySums SumsOf(const std::vector<MarkerTrialResult>& results);

/// What those who drink come to: worst of all trials, but for the mean.
struct DrinkSums {
  int trials = 0, at_mouth = 0;          ///< at_mouth: with the rim within 20 mm of the mouth
  double worst_mm = 0.0, mean_mm = 0.0;  ///< of the rim from the mouth
  std::size_t worst = 0;                 ///< that trial's place in the list
  double lean_deg = 0.0, wrist_mm = 0.0, in_hand_mm = 0.0;
  int no_clean_grasp = 0, in_body_frames = 0;
};
DrinkSums DrinksOf(const std::vector<MarkerTrialResult>& results);

/// Hands and forearms in heads without markers: frames deeper than 2 mm, and the deepest.
struct HeadSums {
  int frames = 0, deep_before = 0, deep = 0;
  double worst_before_mm = 0.0, worst_mm = 0.0;
};
HeadSums HeadsOf(const std::vector<MarkerTrialResult>& results);

/// Each trial solved as it is; with one marker left out (its place from the static trial alone);
/// with gaps; with outliers and a pair of swapped labels. Results in the order of the trials, the
/// same on any number of threads but for times. `progress` may stop it: WorkStopped is thrown.
std::vector<MarkerTrialResult> StudyMarkers(const std::vector<MarkerTrial>& trials,
                                            std::shared_ptr<const BodyModel> model,
                                            const MarkerStudyOptions& options,
                                            const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
