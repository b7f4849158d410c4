// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "geometry/score/hand_object_score.h"

namespace holdfast {

/// Penetration and contact of a clip over all hands, as defined in docs/metrics.md. Depths are over
/// all frames; contact is over the frames in which a hand holds the object.
struct ContactScore {
  struct Frame {
    bool held = false;                 ///< by any hand
    double penetration_mm = 0.0;       ///< deepest over all hands, two-sided
    double object_in_hand_mm = 0.0;    ///< deepest of the object's vertices in a hand
    double mean_penetration_mm = 0.0;  ///< mean depth of the hands' vertices inside; 0 if none
    double min_distance_mm = 0.0;      ///< over all hands' vertices, negative inside
    double contact_ratio = 0.0;        ///< fraction of the holding hands' vertices in contact
    bool in_contact = false;           ///< whether a holding hand touches
    double voxel_volume_cm3 = 0.0;     ///< sum over hands, by voxels; 0 if not measured
  };
  std::vector<Frame> frames;

  double penetration_max_mm = 0.0;
  double penetration_mean_max_mm = 0.0;  ///< mean over frames of the deepest penetration in each
  double penetration_mean_mm = 0.0;      ///< mean over frames of mean_penetration_mm
  double object_in_hand_max_mm = 0.0;
  int deep_frames = 0;                         ///< frames with penetration above the threshold
  double voxel_volume_cm3 = 0.0;               ///< mean over frames
  std::optional<double> contact_frames_ratio;  ///< fraction of held frames in contact, if any
  std::optional<double> contact_ratio;         ///< mean over held frames and their hands
};

inline constexpr double kDeep_mm = 2.0;  ///< penetration deeper than this is visible

/// Scores all hands of one clip; frames with penetration above `deep_mm` are counted.
ContactScore ScoreContact(std::span<const HandObjectScore> hands, double deep_mm = kDeep_mm);

/// Means over the hands, weighted by the number of frames that each hand holds.
CarryJitter MeanJitter(std::span<const HandObjectScore> hands);

}  // namespace holdfast
