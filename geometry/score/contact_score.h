// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "geometry/score/hand_object_score.h"

namespace holdfast {

/// Penetration and contact of a clip, all its hands together: what the rows of docs/metrics.md
/// mean, wherever they stand. Depths are of all frames; contact is of those in which a hand holds.
struct ContactScore {
  struct Frame {
    bool held = false;                 ///< by any hand
    double penetration_mm = 0.0;       ///< deepest of all hands, both ways
    double object_in_hand_mm = 0.0;    ///< deepest of the object's vertices in a hand alone
    double mean_penetration_mm = 0.0;  ///< mean depth of the hands' vertices inside; 0 if none
    double min_distance_mm = 0.0;      ///< of any hand's vertices, negative inside
    double contact_ratio = 0.0;        ///< share of the holding hands' vertices in contact
    bool in_contact = false;           ///< whether a holding hand touches
    double voxel_volume_cm3 = 0.0;     ///< sum over hands, by voxels; 0 if not measured
  };
  std::vector<Frame> frames;

  double penetration_max_mm = 0.0;
  double penetration_mean_max_mm = 0.0;  ///< mean over frames of the deepest in each
  double penetration_mean_mm = 0.0;      ///< mean over frames of mean_penetration_mm
  double object_in_hand_max_mm = 0.0;
  int deep_frames = 0;                         ///< deeper than what was asked for
  double voxel_volume_cm3 = 0.0;               ///< mean over frames
  std::optional<double> contact_frames_ratio;  ///< share of held frames in contact; none if none
  std::optional<double> contact_ratio;         ///< mean over held frames and their hands
};

inline constexpr double kDeep_mm = 2.0;  ///< penetration deeper than this is seen

/// Of all hands of one clip; frames with penetration above `deep_mm` are counted.
ContactScore ScoreContact(std::span<const HandObjectScore> hands, double deep_mm = kDeep_mm);

/// Means over the hands, weighted by the frames that each holds.
CarryJitter MeanJitter(std::span<const HandObjectScore> hands);

}  // namespace holdfast
